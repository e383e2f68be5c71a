"""Serves the page and an export's files to the browsers of this machine, and nothing else."""

import http.server
import mimetypes
import shutil
from collections.abc import Mapping
from http import HTTPStatus
from importlib import resources
from pathlib import Path
from urllib.parse import unquote, urlsplit

from envgen_usd.errors import EnvgenError

HOST = "127.0.0.1"
_PAGE = Path(str(resources.files("envgen_usd.exchange.viewer"))) / "page"
_TYPES = {
    ".js": "text/javascript",
    ".glb": "model/gltf-binary",
    ".html": "text/html; charset=utf-8",
}
_POLICY = (
    "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; "
    "connect-src 'self' blob: data:"
)
"""What the page may load: files of this server (Content Security Policy 3)."""


class PageServer(http.server.ThreadingHTTPServer):
    """Serves until it is shut down; each request has a thread of its own."""

    daemon_threads = True

    def __init__(self, export: Path, port: int = 0) -> None:
        """Opens the port.

        Args:
            export: Folder with `tiles.json`.
            port: Port; 0 takes any free one.

        Raises:
            EnvgenError: The port is taken.
        """
        self.folders = {"gltf": export.resolve(), "page": _PAGE.resolve()}
        try:
            super().__init__((HOST, port), _Handler)
        except (OSError, OverflowError) as error:
            raise EnvgenError(f"--port {port}: cannot be opened ({error}); try another") from error

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{HOST}:{self.server_port}/"


class _Handler(http.server.BaseHTTPRequestHandler):
    """Answers GET and HEAD for the files of two folders."""

    server: PageServer
    protocol_version = "HTTP/1.1"

    def do_GET(self) -> None:
        """Sends a file."""
        self._answer(with_content=True)

    def do_HEAD(self) -> None:
        """Sends the headers of a file."""
        self._answer(with_content=False)

    def log_message(self, format: str, *args: object) -> None:
        """Says nothing: a line for each file would hide the address."""

    def _answer(self, *, with_content: bool) -> None:
        # Another site's page reaches this port under a name of its own (DNS rebinding).
        host = self.headers.get("Host", "").rpartition(":")[0]
        path = file_at(self.path, self.server.folders) if host in {HOST, "localhost"} else None
        if path is None:
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        try:
            with path.open("rb") as file:
                kind = _TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0]
                self.send_response(HTTPStatus.OK)
                self.send_header("Content-Type", kind or "application/octet-stream")
                self.send_header("Content-Length", str(path.stat().st_size))
                self.send_header("Cache-Control", "no-cache")
                self.send_header("Content-Security-Policy", _POLICY)
                self.send_header("X-Content-Type-Options", "nosniff")
                self.end_headers()
                if with_content:
                    shutil.copyfileobj(file, self.wfile, 1 << 20)
        except (BrokenPipeError, ConnectionResetError):
            self.close_connection = True
        except OSError:
            self.send_error(HTTPStatus.NOT_FOUND)


def file_at(target: str, folders: Mapping[str, Path]) -> Path | None:
    """The file of a request, or `None` for what does not exist or lies outside of the folders.

    Args:
        target: Target of the request, e.g. ``/gltf/chunk_0_0.glb?x``.
        folders: Resolved folders by the first part of the path.
    """
    parts = unquote(urlsplit(target).path).removeprefix("/")
    name, _, rest = (parts or "page/index.html").partition("/")
    folder = folders.get(name)
    if folder is None or not rest or "\0" in rest:
        return None
    path = (folder / rest).resolve()
    inside = path.is_relative_to(folder) and path.is_file()
    hidden = (
        any(part.startswith(".") for part in path.relative_to(folder).parts) if inside else True
    )
    return None if hidden else path
