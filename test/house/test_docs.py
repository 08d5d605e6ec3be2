"""What the pages say is there: links, anchors, traps, equations, references, files, order of the glossary."""

import io
import re
import tokenize
from pathlib import Path

import pytest

pytestmark = pytest.mark.check

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "cable_sim_ros"
DOCS = ROOT / "docs"
WIDEST = 100  # characters of a line of prose
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.glob("*.md"))]
SOURCES = [*PACKAGE.rglob("*.py"), *(ROOT / "verification").rglob("*.py")]
CODE = {path: path.read_text("utf-8") for path in sorted(SOURCES)}
THEORY = (DOCS / "theory.md").read_text("utf-8")
REFERENCES = (DOCS / "references.md").read_text("utf-8")
CITED = {  # what the code cites without its year, or in part -> its entry in docs/references.md
    "Westin": "Westin (2018)",
    "von Karman 1929": "von Karman (1929)",
    "Calnan": "Calnan (2016)",
    "Capozucca": "Capozucca (1988)",
    "Choo & Casarella": "Choo and Casarella (1971)",
    "Driscoll & Nahon": "Driscoll and Nahon (1996)",
    "Dymore": "Dymore",
    "Folb and Nelligan": "Folb and Nelligan (1982)",
    "Godhavn": "Godhavn (1998)",
    "Hoerner": "Hoerner (1965)",
    "Hunt-Crossley": "Hunt and Crossley (1975)",
    "Packwood": "Packwood (1990)",
    "Pode": "Pode (1951)",
    "Mansour and Olsen (2004)": "Jensen, Mansour and Olsen (2004)",
    "Yue et al.": "Yue et al. (2016)",
    "REP 103": "REP-103",
    "REP 105": "REP-105",
    "REP-145": "REP-145",
    "REP-2011": "REP-2011",
    "OMG DDSI-RTPS": "OMG DDSI-RTPS",
}
AUTHORS = (
    r"([A-Z][a-z]+(?:-[A-Z][a-z]+)?(?: (?:&|and) [A-Z][a-z]+| et al\.)?),? \((?:19|20)\d\d\)"  # "Name & Name (2007)"
)


def prose(text):
    """A page without its blocks of code."""
    return re.sub(r"^```.*?^```", "", text, flags=re.S | re.M)


def slug(heading):
    """Anchor that a heading gets: lower case, punctuation dropped, blanks to hyphens."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def anchors(text):
    """Every anchor of a page: its headings (repeated ones numbered) and its explicit ids."""
    found = set(re.findall(r'<a id="([^"]+)"></a>', text))
    count = {}
    for heading in re.findall(r"^#{1,6} (.+)$", prose(text), re.M):
        name = slug(heading)
        found.add(name if name not in count else f"{name}-{count[name]}")
        count[name] = count.get(name, 0) + 1
    return found


def numbers(text):
    """Equation numbers in brackets, ranges like (58)-(65) taken apart: a set of int."""
    found = set()
    for first, last in re.findall(r"(?<![\w)])\((\d{1,3})[a-d]?\)(?:-\((\d{1,3})[a-d]?\))?", text):
        found |= set(range(int(first), int(last or first) + 1))
    return found


def wrong_links(page, text):
    """Links of a page that lead nowhere."""
    wrong = []
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(text)):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        path = page.parent / name if name else page
        if not path.exists():
            wrong.append(f"{target}: no such file")
        elif anchor and anchor not in anchors(path.read_text("utf-8")):
            wrong.append(f"{target}: no such anchor")
    return wrong


def too_wide(text):
    """Lines of prose over WIDEST characters that have a blank to break at; a link or a piece of code stays whole."""
    rest = re.sub(r"^ *(```|\$\$).*?(?:^ *```|\$\$)$", "", text, flags=re.S | re.M)
    wide = [line for line in rest.splitlines() if len(line) > WIDEST and not re.match(r" *[|#]|    ", line)]
    whole = r"!?\[[^\]]*\]\([^)]*\)|(`+)[^`]+\1|\$[^$]+\$"
    return [line for line in wide if " " in re.sub(whole, "x", re.sub(r"^ *(?:[-*+] +|\d+[.)] +)?", "", line))]


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_lines_of_prose_are_not_too_wide(page):
    assert too_wide(page.read_text("utf-8")) == []


def test_a_wide_line_is_found():
    line = "a word and " * 10
    link = f"* [{line}](theory.md)"
    allowed = f"| {line} |\n\n```\n{line}\n```\n\n$$a\n{line}$$\n\n# {line}\n\n{link}\n"
    assert too_wide(allowed) == []
    assert too_wide(f"{allowed}* {line}\n  {link} then\n") == [f"* {line}", f"  {link} then"]


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_links_and_anchors_resolve(page):
    assert wrong_links(page, page.read_text("utf-8")) == []


def test_a_broken_link_is_found():
    text = "[a](nowhere.md) [b](#traps) [c](#elsewhere) [d](references.md#water) [e](limits.md#t99) [f](http://x.y)"
    wrong = wrong_links(DOCS / "theory.md", text)
    assert wrong == ["nowhere.md: no such file", "#elsewhere: no such anchor", "limits.md#t99: no such anchor"]


def test_explicit_anchors_are_unique():
    for page in PAGES:
        ids = re.findall(r'<a id="([^"]+)"></a>', page.read_text("utf-8"))
        assert len(ids) == len(set(ids)), page.name


def test_every_picture_is_shown_on_a_page():
    shown = {path.name for page in PAGES for path in map(Path, re.findall(r"\]\(([^)\s]+)\)", page.read_text("utf-8")))}
    assert {path.name for path in DOCS.glob("*.[ps][nv]g")} - shown == set()


def test_every_page_is_in_the_index():
    index = (DOCS / "index.md").read_text("utf-8")
    linked = {target.partition("#")[0] for target in re.findall(r"\]\(([^)\s]+)\)", index)}
    assert {page.name for page in DOCS.glob("*.md")} - {"index.md"} <= linked


def test_every_trap_that_is_cited_has_its_anchor():
    there = anchors(THEORY)
    assert {f"t{n}" for n in range(1, 11)} <= there
    cited = {n for text in CODE.values() for n in re.findall(r"\btraps? T(\d+)", text)}
    assert cited
    assert {f"t{n}" for n in cited} <= there


def comments(text):
    """Docstrings, texts and comments of a source file."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return " ".join(token.string for token in tokens if token.type in (tokenize.COMMENT, tokenize.STRING))


def test_every_equation_that_the_physics_cites_stands_in_the_last_table_of_the_theory():
    cited = set().union(*(numbers(comments(text)) for path, text in CODE.items() if path.parent.name == "physics"))
    assert {58, 93, 105, 136, 145} <= cited
    assert cited - numbers(THEORY.partition('<a id="print"></a>')[2]) == set()


@pytest.mark.parametrize("name", CITED)
def test_cited_works_have_their_reference(name):
    assert any(name in text for text in CODE.values()), f"{name} is cited nowhere: take it off the list"
    assert f"**{CITED[name]}" in REFERENCES


def test_every_author_with_a_year_has_its_reference():
    pages = [prose((DOCS / f"{page}.md").read_text("utf-8")) for page in ("theory", "limits", "index")]
    cited = (match[0] for text in (*CODE.values(), *pages) for match in re.finditer(AUTHORS, text))
    found = {one.replace(" &", " and") for one in cited}
    assert len(found) > 20
    assert {one for one in found if f"**{one}**" not in REFERENCES and one not in CITED} == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_files_named_on_a_page_exist(page):
    text = page.read_text("utf-8")
    for path in re.findall(r"`((?:physics|sim|io|runs|ros|tools|cli)/[\w/]+\.py)`", text):
        assert (PACKAGE / path).exists(), path
    for path in re.findall(r"`((?:test|docs|config|bags|\.ci)/[\w/.]*)`", text):
        assert (ROOT / path).exists(), path


def test_parameters_named_on_a_page_exist():
    manual = (DOCS / "parameters.md").read_text("utf-8")
    known = set(re.findall(r"^\| `([\w.<>]+)` \|", manual, re.M))
    blocks = {name.partition(".")[0] for name in known if "." in name}
    for page in ("theory.md", "limits.md", "glossary.md"):
        for name in re.findall(r"`(\w+\.\w+)`", (DOCS / page).read_text("utf-8")):
            if name.partition(".")[0] in blocks:
                assert name in known, f"{page}: {name}"


def test_the_glossary_is_in_alphabetical_order():
    terms = re.findall(r"^\*\*(.+?)\*\*", (DOCS / "glossary.md").read_text("utf-8"), re.M)
    assert len(terms) > 50
    assert [term.casefold() for term in terms] == sorted(term.casefold() for term in terms)
