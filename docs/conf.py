"""Sphinx: the site of these pages, `make docs`. The pages stay plain Markdown; what only the site has is added here.

The folder of the sources is the top folder of the repository, so that a link from a page to the README or to a file is
the same path as on a repository page. rosdoc2 copies the pages into the same order and takes this file too.
"""

import html
import inspect
import re
import sys
from pathlib import Path

from docutils import nodes
from sphinx.transforms import SphinxTransform
from sphinx.util import logging

TOP = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TOP))  # an environment without the package still has its names
# linked from pages, behind no door
BESIDE = ["CHANGELOG", "QUALITY_DECLARATION", "bags/README", "test/examples/README"]
ALONE = "rosdoc2_settings" not in globals()  # rosdoc2 has a first page of its own

project = "cable_sim_ros"
author = copyright = "cable_sim_ros maintainers"
release = re.search(r'__version__ = "(.+)"', (TOP / "cable_sim_ros/version.py").read_text("utf-8"))[1] if ALONE else ""
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
if ALONE:
    root_doc = "README"
    html_math_renderer = "mathml"  # read without a network, and a formula that is wrong fails the build
    include_patterns = [
        "README.md",
        "CONTRIBUTING.md",
        "docs/*.md",
        "CHANGELOG.rst",
        *(f"{name}.md" for name in BESIDE),
    ]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 6  # every heading is an anchor, named as a repository page names it
myst_heading_anchors_html_ids = True
default_role = "code"  # of docstrings
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
python_maximum_signature_line_length = 90
autodoc_default_options = {
    "members": True,
    "inherited-members": "Exception",
    "exclude-members": "bring_to_rest, chunk_tables, stiffness, tolerance",  # public for other floors alone
}

html_theme = "furo"
html_title = f"cable_sim_ros {release}"
html_copy_source = False
if ALONE:
    html_static_path = html_css_files = ["site.css"]


def doors(top):
    """A table of contents for each door of docs/index.md, of the pages that it links as a whole; each page once."""
    text, seen = Path(top, "docs/index.md").read_text("utf-8"), {"README"}
    contents, door = ["```{toctree}\n:hidden:\n\n/docs/index\n```"], ""
    for level, title, part in re.findall(r"^(##+) (.+?)$(.*?)(?=^##|\Z)", text, re.M | re.S):
        door, caption = (title, title) if level == "##" else (door, f"{door}: {title[0].lower()}{title[1:]}")
        linked = re.findall(r"\]\(([\w./]+)\.md\)", part) + (BESIDE if ALONE and door == "Developers" else [])
        pages = [page if page in BESIDE else page[3:] if page.startswith("../") else f"docs/{page}" for page in linked]
        pages = [page for page in dict.fromkeys(pages) if not (page in seen or seen.add(page))]
        if pages:
            entries = "\n".join(f"/{page}" for page in pages)
            contents.append(f"```{{toctree}}\n:hidden:\n:caption: '{caption}'\n\n{entries}\n```")
    return "\n\n".join(contents)


def complete(app, docname, content):
    """What a page has on the site alone: the navigation, and the docstrings where a comment asks for them."""
    if docname == ("README" if ALONE else "docs/index"):
        content[0] += "\n\n" + doors(app.srcdir)
    asked = r"<!-- (auto\w+) (cable_sim_ros\.[\w.]+) -->"
    content[0] = re.sub(asked, r"```{eval-rst}\n.. \1:: \2\n```\n", content[0])


def arguments(app, what, name, obj, options, lines):
    """A docstring says "name: text; name: text" of its arguments: each becomes an item of a list."""
    try:
        known = "|".join(inspect.signature(obj).parameters)
    except (TypeError, ValueError):
        return
    out = []
    for paragraph in "\n".join(lines).split("\n\n"):
        some = rf"(?:{known})(?:(?:, | and )(?:{known}))*"
        parts = re.split(rf"(?:\A|(?<=[;.])\s+)({some}):\s", paragraph) if known else [paragraph]
        out += [*parts[0].split("\n"), ""]
        for names, text in zip(parts[1::2], parts[2::2]):
            out += [f"* **{names}**: {' '.join(text.split())}"]
        out += [""]
    lines[:] = out


def signature(app, what, name, obj, options, text, returned):
    """A default that is a member of an enum stands as it is written in Python."""
    return text and re.sub(r"<(\w+\.\w+): [^>]*>", r"\1", text), returned


def mathml(translator, node):
    """A formula as MathML, which browsers draw by themselves."""
    from docutils.utils.math import MathError, latex2mathml

    tex = re.sub(r"\\Big\b", "", re.sub(r"\A(?=\^)", "{}", node.astext()))  # what docutils does not know
    tex = re.sub(r"\\tfrac(\d)(\d)", r"\\tfrac{\1}{\2}", tex)
    try:
        text = latex2mathml.tex2mathml(tex, as_block=isinstance(node, nodes.math_block))
    except (MathError, IndexError) as error:
        logging.getLogger(__name__).warning("formula not understood: %s", error, location=node, type="math")
        text = f"<code>{html.escape(node.astext())}</code>"
    text = re.sub(r"<mi[^>]*>([a-z]{2,})</mi>", r'<mo lspace="0.17em" rspace="0.17em">\1</mo>', text)  # sin x
    translator.body.append(text)
    raise nodes.SkipNode


class Anchors(SphinxTransform):
    """Links of all pages find <a id="..."></a>; any other tag is a word in angle brackets that no viewer shows."""

    default_priority = 870  # before myst_parser resolves links within the page

    def apply(self):
        """Register each; on a line of its own it is no paragraph."""
        slugs = self.env.metadata[self.env.docname].setdefault("myst_slugs", getattr(self.document, "myst_slugs", {}))
        for raw in list(self.document.findall(nodes.raw)):
            if found := re.match(r'<a id="([^"]+)">', raw.astext()):
                slugs[found[1]] = (raw.line, found[1], "")
                if raw.parent.astext() == f"{raw.astext()}</a>":
                    raw.parent.replace_self(nodes.target(ids=[found[1]]))
            elif not re.fullmatch(r"</a>|<br>|<!--.*-->\s*", raw.astext(), re.S):
                logging.getLogger(__name__).warning("raw HTML: %s", raw.astext(), location=raw, type="html")


def first_page(app, error):
    """The README under the name that a web server looks for."""
    if ALONE and not error:
        Path(app.outdir, "index.html").write_text('<meta http-equiv="refresh" content="0; url=README.html">\n')


def setup(app):
    """Register the above."""
    app.connect("source-read", complete)
    app.connect("autodoc-process-docstring", arguments)
    app.connect("autodoc-process-signature", signature)
    app.connect("build-finished", first_page)
    app.add_html_math_renderer("mathml", (mathml, None), (mathml, None))
    app.add_transform(Anchors)
