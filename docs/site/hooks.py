"""What the site has beside docs/: the README as its first page, the gallery, the Python and the C++ reference."""

import pathlib
import re

from mkdocs.structure.files import File, InclusionLevel

ROOT = pathlib.Path(__file__).resolve().parents[2]
MADE = ROOT / "build" / "docs"

# Pages that stand outside docs/, by their place in the site.
OUTSIDE = {"index.md": "README.md", "contributing.md": "CONTRIBUTING.md", "data.md": "tests/data/README.md"}
# What links of docs/ and of those pages lead to.
PLACES = {source: page for page, source in OUTSIDE.items()}

LINK = re.compile(r"\]\((?!https?:|#|<)([^)\s#]+)(#[^)\s]*)?\)")


def link_in_site(source, page, target):
    """A link of a file of the repository, as its page of the site has it; links to no page are left as they are."""
    place = (ROOT / source).parent.joinpath(target).resolve()
    if not place.is_relative_to(ROOT):
        return target
    name = place.relative_to(ROOT).as_posix()
    name = PLACES.get(name, name.removeprefix("docs/"))
    up = "../" * page.count("/")
    return up + name


def on_files(files, config):
    for page, source in OUTSIDE.items():
        files.append(File.generated(config, page, content=(ROOT / source).read_text(encoding="utf-8")))
    files.append(File.generated(config, "python-reference.md", content="# Python reference\n\n::: btfield\n"))
    css = (ROOT / "docs/site/site.css").read_text(encoding="utf-8")
    files.append(File.generated(config, "site.css", content=css))
    for folder, prefix in ((MADE / "gallery", ""), (MADE / "cpp", "cpp/")):
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                made = File.generated(config, prefix + path.relative_to(folder).as_posix(), abs_src_path=str(path))
                made.inclusion = InclusionLevel.INCLUDED
                files.append(made)
    return files


def on_page_markdown(markdown, page, config, files):
    del config, files
    name = page.file.src_uri
    source = OUTSIDE.get(name, f"docs/{name}")

    def moved(match):
        return f"]({link_in_site(source, name, match[1])}{match[2] or ''})"

    # Links within docs/ mean the same there and here.
    if name in OUTSIDE or "](../" in markdown:
        markdown = LINK.sub(moved, markdown)
    return markdown
