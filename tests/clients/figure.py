"""A row of the table of clients that scripts/client_figures prints: who read, and what came of it."""


def figure(client, text):
    print(f"figure | {client} | {text}")
