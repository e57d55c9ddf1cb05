"""Other people's servers, as Debian has them: alone, or in front of the daemon."""
import socket
import subprocess
import time

from .programme import NotHere, needs

KEY = "of-the-front-end-and-of-nobody-else"  # in an X-API-Key of each request that one of them sends on


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
    location = (f"proxy_pass http://127.0.0.1:{behind}; proxy_http_version 1.1; proxy_set_header Connection ''; proxy_set_header X-API-Key {KEY}; "
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
    answer = (f"  http-request set-header X-API-Key {KEY}\n  default_backend d\nbackend d\n  retries 0\n  http-reuse always\n  server s 127.0.0.1:{behind}\n"
              if behind else "  http-request return status 200 content-type text/plain string hello\n")
    folder = written(work, "haproxy", "global\n  maxconn 512\ndefaults\n  mode http\n  timeout connect 5s\n  timeout client 20s\n"
                     f"  timeout server 20s\nfrontend f\n  bind 127.0.0.1:{port}\n{answer}")
    return Peer("haproxy", ["haproxy", "-db", "-f", folder / "conf"], port)


def h2o(work, behind=None):
    needs("h2o")
    port = free_port()
    folder = written(work, "h2o", "")
    (folder / "index.html").write_text("hello")
    path = (f'proxy.reverse.url: "http://127.0.0.1:{behind}/"\n        proxy.preserve-host: ON\n        proxy.header.set: "X-API-Key: {KEY}"'
            if behind else f"file.dir: {folder}")
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
                     f'sub vcl_recv {{ return (pass); }}\nsub vcl_backend_fetch {{ set bereq.http.X-API-Key = "{KEY}"; }}\n')
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
LoadModule headers_module {modules}/mod_headers.so
DefaultRuntimeDir {folder}
RequestHeader set X-API-Key {KEY}
ProxyPass / http://127.0.0.1:{behind}/ retry=0
""")
    return Peer("apache2", ["apache2", "-X", "-f", folder / "conf"], port)


def lighttpd(work, behind):
    needs("lighttpd")
    port = free_port()
    folder = written(work, "lighttpd", f"""server.document-root = "{work}"
server.port = {port}
server.bind = "127.0.0.1"
server.modules = ("mod_setenv", "mod_proxy")
setenv.set-request-header = ("X-API-Key" => "{KEY}")
proxy.server = ("" => (("host" => "127.0.0.1", "port" => {behind})))
""")
    return Peer("lighttpd", ["lighttpd", "-D", "-f", folder / "conf"], port)


def squid(work, behind):
    needs("squid")
    port = free_port()
    folder = written(work, "squid", f"""http_port 127.0.0.1:{port} accel defaultsite=test no-vhost
cache_peer 127.0.0.1 parent {behind} 0 no-query originserver name=d
cache_peer_access d allow all
http_access allow all
never_direct allow all
cache deny all
request_header_add X-API-Key {KEY} all
access_log none
cache_log {work}/squid/log
pid_filename {work}/squid/pid
coredump_dir {work}/squid
shutdown_lifetime 1 seconds
workers 1
""")
    return Peer("squid", ["squid", "-N", "-f", folder / "conf"], port)


def nghttpx(work, behind):
    needs("nghttpx")
    port = free_port()
    folder = written(work, "nghttpx", f"""frontend=127.0.0.1,{port};no-tls
backend=127.0.0.1,{behind}
workers=1
single-process=yes
add-request-header=X-API-Key:{KEY}
errorlog-file={work}/nghttpx/log
pid-file={work}/nghttpx/pid
""")
    return Peer("nghttpx", ["nghttpx", f"--conf={folder / 'conf'}"], port)


def caddy(work, behind):
    needs("caddy")
    port = free_port()
    folder = written(work, "caddy", f"""{{
\tadmin off
\tauto_https off
}}
http://:{port} {{
\tbind 127.0.0.1
\treverse_proxy 127.0.0.1:{behind} {{
\t\theader_up X-API-Key {KEY}
\t}}
}}
""")
    return Peer("caddy", ["env", f"HOME={folder}", f"XDG_DATA_HOME={folder}", f"XDG_CONFIG_HOME={folder}",
                          "caddy", "run", "--adapter", "caddyfile", "--config", folder / "conf"], port)


def trafficserver(work, behind):
    needs("traffic_server")
    port = free_port()
    folder = written(work, "trafficserver", "")
    for name in ("etc", "var", "log", "cache"):
        (folder / name).mkdir(exist_ok=True)
        (folder / name).chmod(0o777)
    (folder / "runroot.yaml").write_text(f"""prefix: {folder}
exec_prefix: {folder}
bindir: /usr/bin
sbindir: /usr/sbin
sysconfdir: {folder}/etc
datadir: {folder}/cache
includedir: /usr/include
libdir: /usr/lib/trafficserver
libexecdir: /usr/lib/trafficserver/modules
localstatedir: {folder}/var
runtimedir: {folder}/var
logdir: {folder}/log
cachedir: {folder}/cache
""")
    (folder / "etc/remap.config").write_text(f"map / http://127.0.0.1:{behind}/\n")
    (folder / "etc/plugin.config").write_text(f"header_rewrite.so {folder}/etc/key.config\n")
    (folder / "etc/key.config").write_text(f'cond %{{SEND_REQUEST_HDR_HOOK}}\nset-header X-API-Key "{KEY}"\n')
    (folder / "etc/ip_allow.yaml").write_text("ip_allow:\n  - apply: in\n    ip_addrs: 127.0.0.1\n    action: allow\n    methods: ALL\n")
    (folder / "etc/storage.config").write_text(f"{folder}/cache 16M\n")
    (folder / "etc/records.config").write_text(f"""CONFIG proxy.config.http.server_ports STRING {port}:ip-in=127.0.0.1
CONFIG proxy.config.http.cache.http INT 0
CONFIG proxy.config.reverse_proxy.enabled INT 1
CONFIG proxy.config.url_remap.remap_required INT 1
CONFIG proxy.config.url_remap.pristine_host_hdr INT 1
CONFIG proxy.config.log.logging_enabled INT 0
CONFIG proxy.config.exec_thread.autoconfig INT 0
CONFIG proxy.config.exec_thread.limit INT 1
CONFIG proxy.config.http.connect_attempts_max_retries INT 0
CONFIG proxy.config.admin.user_id STRING #-1
""")
    return Peer("trafficserver", ["traffic_server", f"--run-root={folder}/runroot.yaml"], port)


SERVERS = {"nginx": nginx, "haproxy": haproxy, "h2o": h2o}
FRONTS = {"haproxy": haproxy, "varnish": varnish, "nginx": nginx, "apache2": apache, "lighttpd": lighttpd, "h2o": h2o,
          "squid": squid, "trafficserver": trafficserver, "nghttpx": nghttpx, "caddy": caddy}
