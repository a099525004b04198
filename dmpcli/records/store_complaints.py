"""What an object store complains of, in our words: by its codes, and none of its own words.

A store's words may repeat keys, and what was signed with them.
"""

import os
import re

from dmpcli.errors import DmpError, InputError, InstrumentError

_CODE = re.compile(r"AWS Error (\w+)(?: \(HTTP status (\d+)\))?")
_NAMED = re.compile(r"ExceptionName: (\w+)")
_BUSY = re.compile(r"slow_?down|throttl|too_?many|service_?unavailable|limit_?exceeded", re.I)
_LOST = re.compile(r"network_?connection|timeout|curlcode|resolve|unavailable|connect", re.I)
_BARRED = re.compile(
    r"access_?denied|invalid_?access|signature|expired_?token|invalid_?(client_?)?token|"
    r"unrecognized_?client|forbidden|permission|unauth|credential|40[13]\b",
    re.I,
)
_ELSEWHERE = re.compile(r"permanent_?redirect|illegal_?location|authorization_?header|\b301", re.I)
_NO_BUCKET = re.compile(r"no_?such_?bucket|bucket '[^']*' not found", re.I)


def complaint(root: str, path: str, text: str, tried: int) -> DmpError:
    """Return what is told of a request that failed.

    Parameters
    ----------
    root : str
        Scheme and bucket.
    path : str
        Of the object.
    text : str
        Of Arrow's error.
    tried : int
        How often the request was made.
    """
    code = _code(text)
    if _NO_BUCKET.search(code) or _NO_BUCKET.search(text):
        return no_bucket(root)
    if _ELSEWHERE.search(code):
        return InputError(f"{path}: its bucket is in another region ({code}); set AWS_REGION to it")
    if _BARRED.search(code):
        return InputError(f"{path}: the store refuses it ({code}); {_remedy(root)}")
    if _BUSY.search(code):
        return InstrumentError(
            f"{path}: the store has no time ({code}), asked {tried} times; the same command "
            "goes on from here, later or with fewer --jobs"
        )
    if _LOST.search(code) or _LOST.search(text):
        what = "the network"
        if root.startswith("s3:"):
            what += ", and AWS_ENDPOINT_URL if it is not Amazon's"
        elif root.startswith("gs:"):
            what += ", and that credentials are set: GOOGLE_APPLICATION_CREDENTIALS=FILE"
        return InstrumentError(f"{path}: the store is not reached ({code}); check {what}")
    return InstrumentError(f"{path}: the store fails ({code}); the same command goes on from here")


def _code(text: str) -> str:
    """Return what a store's answer is called; words of its own may hold more than one may tell."""
    found, named = _CODE.search(text), _NAMED.search(text)
    if named:
        return named[1]
    if found is None:
        status = re.search(r"\b(?:HTTP |status |code )+(\d{3})\b", text, re.I)
        return f"HTTP {status[1]}" if status else "no code"
    return f"HTTP {found[2]}" if found[2] else found[1]


def no_bucket(root: str) -> InputError:
    """Return what is told of a bucket that is not there."""
    return InputError(f"{root}: there is no such bucket; check the name, or make it first")


def _remedy(root: str) -> str:
    if root.startswith("s3:") and not _have_credentials():
        return "no credentials are set: AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or AWS_PROFILE"
    return "check the credentials in the environment, and what they are allowed"


def _have_credentials() -> bool:
    """Tell whether the environment names any, but for those of the machine itself."""
    names = (
        *("AWS_ACCESS_KEY_ID", "AWS_PROFILE", "AWS_WEB_IDENTITY_TOKEN_FILE"),
        *("AWS_CONTAINER_CREDENTIALS_RELATIVE_URI", "AWS_CONTAINER_CREDENTIALS_FULL_URI"),
    )
    file = os.environ.get("AWS_SHARED_CREDENTIALS_FILE") or os.path.expanduser("~/.aws/credentials")
    return any(os.environ.get(name) for name in names) or os.path.exists(file)
