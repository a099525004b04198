"""The pages say what the program says, lead where they say, and stay short."""

import re
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType

import pytest

from tests.docs.pages import PAGES, ROOT, name_of
from tools import reference

REFERENCE = sorted((ROOT / "docs" / "reference").glob("*.md"))


def test_the_reference_is_made_from_the_program():
    made = reference.pages()
    assert {page.name for page in REFERENCE} == set(made)
    for page in REFERENCE:
        assert page.read_text() == made[page.name], "make reference"


def test_readme_is_short():
    assert len((ROOT / "README.md").read_text().splitlines()) < 200


def anchors(page):
    """The anchors of a page's headings, as GitHub and MyST make them."""
    heads = re.findall(r"^#+ (.+)$", re.sub(r"```.*?```", "", page.read_text(), flags=re.S), re.M)
    bare = [re.sub(r"[^\w\- ]", "", head.replace("`", "").lower()) for head in heads]
    return {head.replace(" ", "-") for head in bare}


@pytest.mark.parametrize("page", [*PAGES, *REFERENCE], ids=name_of)
def test_links_lead_somewhere(page):
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.S)
    for target, anchor in re.findall(r"\]\(([^)#\s]*)(#[^)\s]+)?\)", text):
        if target.startswith(("http:", "https:")):
            continue
        file = page.parent / target if target else page
        assert file.exists(), target
        if anchor:
            assert anchor[1:] in anchors(file), f"{target}{anchor}"


def test_every_page_is_in_the_site():
    index = (ROOT / "docs" / "index.md").read_text()
    listed = set(re.findall(r"^([\w/]+)$", "\n".join(re.findall(r"\n\n([^`:]+)```", index)), re.M))
    pages = {str(p.relative_to(ROOT / "docs").with_suffix("")) for p in REFERENCE}
    pages |= {page.stem for page in (ROOT / "docs").glob("*.md")} - {"index"}
    assert listed == pages


def texts():
    """Every text in the program, as one string a module; what is put into one parts it in two."""
    for file in sorted((ROOT / "dmpcli").rglob("*.py")):
        # The byte code that is kept, where it is not older: to parse all modules takes seconds.
        code = SourceFileLoader(file.stem, str(file)).get_code(file.stem)
        yield "\n".join(_strings(code))


def _strings(constant):
    if isinstance(constant, str):
        yield constant
    elif isinstance(constant, CodeType | tuple | frozenset):
        for one in constant.co_consts if isinstance(constant, CodeType) else constant:
            yield from _strings(one)


@pytest.mark.slow
def test_every_message_of_the_troubleshooting_page_is_one_of_the_program():
    whole = "\n".join(texts())
    page = (ROOT / "docs" / "troubleshooting.md").read_text().split("## The shell")[0]
    messages = re.findall(r"^\| `(.+?)` \|", page, re.M)
    assert len(messages) > 25
    for message in messages:
        pieces = [piece.strip() for piece in message.split("…")]
        pieces = [piece for piece in pieces if len(piece) > 3]
        assert pieces, message
        for piece in pieces:
            assert piece in whole, f"{message}: {piece!r}"


def test_files_that_pages_name_are_there():
    for page in PAGES:
        if page.name == "CHANGELOG.md":
            continue
        named = re.findall(r"`((?:dmpcli|tests|docs|tools|benchmarks|sample_runs)/[\w/.-]+\.\w+)`",
                           page.read_text())  # fmt: skip
        missing = [name for name in named if not Path(ROOT / name).exists()]
        assert missing == [], name_of(page)
