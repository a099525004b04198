"""An S3 server on loopback for tests: moto behind a door that can refuse, delay and count."""

import contextlib
import os
import re
import socket
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest

BUCKET = "strokes"
SECRETS = {"AWS_ACCESS_KEY_ID": "AKIANOBODYSKEY00", "AWS_SECRET_ACCESS_KEY": "no/bodys+secret=00"}

ERROR = (
    '<?xml version="1.0" encoding="UTF-8"?>\n<Error><Code>{code}</Code><Message>{message}'
    "</Message><RequestId>1</RequestId></Error>"
)


@dataclass
class Fault:
    """What befalls requests.

    Attributes
    ----------
    method, path : str
        Regular expressions of those that it befalls; the path with its query.
    status, code : str
        Of the answer; without a status the connection is cut.
    times : int
        How many it befalls before it is over.
    after : int
        How many pass before.
    """

    method: str = ".*"
    path: str = ".*"
    status: str = "503 Slow Down"
    code: str = "SlowDown"
    times: int = 1 << 30
    after: int = 0


@dataclass
class Store:
    """A running server.

    Attributes
    ----------
    address : str
    faults : list of Fault
    requests : list of str
        Method and path of each request that came.
    happened : callable, optional
        Called with the method and path of each, before it is answered.
    """

    address: str
    faults: list[Fault] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)
    happened: Callable[[str, str], None] | None = None
    _lock: Any = field(default_factory=threading.Lock)

    @property
    def environment(self) -> dict[str, str]:
        """What a process needs to know of it, and nothing of whoever runs the tests."""
        return SECRETS | {
            "AWS_ENDPOINT_URL": self.address,
            "AWS_REGION": "us-east-1",
            "AWS_EC2_METADATA_DISABLED": "true",
            "AWS_MAX_ATTEMPTS": "6",
        }

    def fault_of(self, method: str, path: str) -> Fault | None:
        """Note a request, and return what is to befall it."""
        with self._lock:
            self.requests.append(f"{method} {path}")
            for fault in self.faults:
                if re.fullmatch(fault.method, method) and re.search(fault.path, path):
                    if fault.after > 0:
                        fault.after -= 1
                    elif fault.times > 0:
                        fault.times -= 1
                        return fault
        return None

    def client(self) -> Any:
        """Return a client of another make, which judges what is there."""
        import boto3

        return boto3.client(
            "s3",
            endpoint_url=self.address,
            region_name="us-east-1",
            aws_access_key_id=SECRETS["AWS_ACCESS_KEY_ID"],
            aws_secret_access_key=SECRETS["AWS_SECRET_ACCESS_KEY"],
        )

    def objects(self, prefix: str = "", bucket: str = BUCKET) -> dict[str, bytes]:
        """Return the objects under a prefix, without it; marks of folders left out."""
        client, found = self.client(), {}
        for page in client.get_paginator("list_objects_v2").paginate(Bucket=bucket, Prefix=prefix):
            for one in page.get("Contents", []):
                key = one["Key"]
                if not key.endswith("/"):
                    body = client.get_object(Bucket=bucket, Key=key)["Body"].read()
                    found[key.removeprefix(prefix)] = body
        return found


@contextlib.contextmanager
def served() -> Iterator[Store]:
    """Run a server with one empty bucket, `BUCKET`."""
    # Loaded where a server runs: every process collects these tests, and few run one.
    from moto.server import DomainDispatcherApplication, create_backend_app
    from werkzeug.serving import WSGIRequestHandler, make_server

    class Quiet(WSGIRequestHandler):
        def log(self, type: str, message: str, *args: Any) -> None:  # noqa: A002
            """Say nothing."""

    inner = DomainDispatcherApplication(create_backend_app)
    store = Store("")

    def door(environ: dict[str, Any], start: Any) -> Any:
        path, query = environ["PATH_INFO"], environ.get("QUERY_STRING", "")
        path, method = path + ("?" + query if query else ""), environ["REQUEST_METHOD"]
        fault = store.fault_of(method, path)
        if store.happened is not None:
            store.happened(method, path)
        if fault is None:
            return inner(environ, start)
        if not fault.status:
            environ["werkzeug.socket"].shutdown(socket.SHUT_RDWR)
            return []
        environ["wsgi.input"].read(int(environ.get("CONTENT_LENGTH") or 0))
        text = "" if method == "HEAD" else ERROR.format(code=fault.code, message="a fault of ours")
        body = text.encode()
        head = [("Content-Type", "application/xml"), ("Content-Length", str(len(body)))]
        start(fault.status, head)
        return [body]

    server = make_server("127.0.0.1", 0, door, threaded=True, request_handler=Quiet)
    store.address = f"http://127.0.0.1:{server.server_port}"
    running = threading.Thread(target=server.serve_forever, daemon=True)
    running.start()
    try:
        store.client().create_bucket(Bucket=BUCKET)
        empty(store)  # of what another server of this process has left
        yield store
    finally:
        server.shutdown()
        server.server_close()
        running.join()


def empty(store: Store) -> None:
    """Take everything out of the bucket, and let nothing befall requests."""
    store.faults.clear()
    store.happened = None
    client = store.client()
    for page in client.get_paginator("list_objects_v2").paginate(Bucket=BUCKET):
        for one in page.get("Contents", []):
            client.delete_object(Bucket=BUCKET, Key=one["Key"])
    store.requests.clear()


@contextlib.contextmanager
def used(store: Store, monkeypatch: pytest.MonkeyPatch) -> Iterator[Store]:
    """This process uses the server, empty at first, and no other store."""
    for name in [name for name in os.environ if name.startswith("AWS_")]:
        monkeypatch.delenv(name)
    for name, value in store.environment.items():
        monkeypatch.setenv(name, value)
    empty(store)
    yield store
    empty(store)


def environment_of(store: Store) -> dict[str, str]:
    """Return the environment of a process that is to use the server."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("AWS_", "GOOGLE_", "AZURE_"))}
    return kept | store.environment
