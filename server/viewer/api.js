// The page /api: the daemon's own OpenAPI document in Swagger UI. Asks no other host.
if (window.SwaggerUIBundle)
  window.SwaggerUIBundle({
    url: "openapi.json",
    dom_id: "#api",
    validatorUrl: null,
    deepLinking: true,
    docExpansion: "none",
    tryItOutEnabled: true,
  });
