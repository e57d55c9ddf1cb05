"""Other people's servers, as Debian has them: alone, or in front of the daemon."""
import socket
import subprocess
import time

from .programme import NotHere, needs


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Peer:
    def __init__(self, name, command, port):
        self.name, self.port = name, port
        self.process = subprocess.Popen([str(c) for c in command], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.PIPE, start_new_session=True)
        for _ in range(200):
            try:
                socket.create_connection(("127.0.0.1", port), 1).close()
                return
            except OSError:
                if self.process.poll() is not None:
                    raise NotHere(f"{name} does not start: {self.process.stderr.read().decode(errors='replace')[-300:]}")
                time.sleep(0.05)
        raise NotHere(f"{name} does not listen")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.process.stderr.close()


def written(work, name, text):
    folder = work / name
    folder.mkdir(exist_ok=True)
    (folder / "conf").write_text(text)
    folder.chmod(0o777)
    work.chmod(0o755)
    return folder


def nginx(work, behind=None):
    needs("nginx")
    port = free_port()
    location = (f"proxy_pass http://127.0.0.1:{behind}; proxy_http_version 1.1; proxy_set_header Connection ''; "
                "proxy_next_upstream off;" if behind else "return 200 'hello';")
    upstream = f"upstream u {{ server 127.0.0.1:{behind}; keepalive 8; }}" if behind else ""
    location = location.replace(f"http://127.0.0.1:{behind}", "http://u")
    folder = written(work, "nginx", f"""daemon off; master_process off; error_log stderr crit; pid {work}/nginx/pid;
events {{ worker_connections 512; }}
http {{ access_log off; client_body_temp_path {work}/nginx/b; proxy_temp_path {work}/nginx/p; fastcgi_temp_path {work}/nginx/f;
uwsgi_temp_path {work}/nginx/u; scgi_temp_path {work}/nginx/s; {upstream}
server {{ listen 127.0.0.1:{port}; location / {{ {location} }} }} }}
""")
    return Peer("nginx", ["nginx", "-c", folder / "conf"], port)


def haproxy(work, behind=None):
    needs("haproxy")
    port = free_port()
    answer = (f"  default_backend d\nbackend d\n  retries 0\n  http-reuse always\n  server s 127.0.0.1:{behind}\n" if behind else
              "  http-request return status 200 content-type text/plain string hello\n")
    folder = written(work, "haproxy", "global\n  maxconn 512\ndefaults\n  mode http\n  timeout connect 5s\n  timeout client 20s\n"
                     f"  timeout server 20s\nfrontend f\n  bind 127.0.0.1:{port}\n{answer}")
    return Peer("haproxy", ["haproxy", "-db", "-f", folder / "conf"], port)


def h2o(work, behind=None):
    needs("h2o")
    port = free_port()
    folder = written(work, "h2o", "")
    (folder / "index.html").write_text("hello")
    path = (f'proxy.reverse.url: "http://127.0.0.1:{behind}/"\n        proxy.preserve-host: ON' if behind else f"file.dir: {folder}")
    (folder / "conf").write_text(f"""user: root
listen:
  host: 127.0.0.1
  port: {port}
num-threads: 1
hosts:
  default:
    paths:
      /:
        {path}
""")
    return Peer("h2o", ["h2o", "-m", "worker", "-c", folder / "conf"], port)


def varnish(work, behind):
    needs("varnishd")
    port = free_port()
    folder = written(work, "varnish", f'vcl 4.1;\nbackend d {{ .host = "127.0.0.1"; .port = "{behind}"; }}\n'
                     "sub vcl_recv { return (pass); }\n")
    return Peer("varnish", ["varnishd", "-F", "-a", f"127.0.0.1:{port}", "-f", folder / "conf", "-n", folder / "n", "-s", "malloc,16m",
                            "-p", "thread_pool_min=10", "-j", "none"], port)


def apache(work, behind):
    needs("apache2")
    port = free_port()
    modules = "/usr/lib/apache2/modules"
    folder = written(work, "apache", "")
    (folder / "conf").write_text(f"""ServerRoot {folder}
PidFile {folder}/pid
Listen 127.0.0.1:{port}
ServerName test
ErrorLog {folder}/log
LoadModule mpm_event_module {modules}/mod_mpm_event.so
LoadModule authz_core_module {modules}/mod_authz_core.so
LoadModule proxy_module {modules}/mod_proxy.so
LoadModule proxy_http_module {modules}/mod_proxy_http.so
DefaultRuntimeDir {folder}
ProxyPass / http://127.0.0.1:{behind}/ retry=0
""")
    return Peer("apache2", ["apache2", "-X", "-f", folder / "conf"], port)


def lighttpd(work, behind):
    needs("lighttpd")
    port = free_port()
    folder = written(work, "lighttpd", f"""server.document-root = "{work}"
server.port = {port}
server.bind = "127.0.0.1"
server.modules = ("mod_proxy")
proxy.server = ("" => (("host" => "127.0.0.1", "port" => {behind})))
""")
    return Peer("lighttpd", ["lighttpd", "-D", "-f", folder / "conf"], port)


SERVERS = {"nginx": nginx, "haproxy": haproxy, "h2o": h2o}
FRONTS = {"haproxy": haproxy, "varnish": varnish, "nginx": nginx, "apache2": apache, "lighttpd": lighttpd, "h2o": h2o}
