"""Refuses a site with links that lead nowhere, or that needs the network to be read.

check_links.py FOLDER
"""

import html.parser
import pathlib
import sys
import urllib.parse

# Where a page loads what it needs to be shown.
LOADED = {("script", "src"), ("img", "src"), ("link", "href"), ("iframe", "src"), ("source", "src"), ("video", "src")}
# What of <link> is no more than told.
TOLD = {"canonical", "next", "prev", "alternate", "edit"}


class Page(html.parser.HTMLParser):
    """Anchors of a page, and what it leads to: (address, whether it is loaded)."""

    def __init__(self, text):
        super().__init__()
        self.anchors, self.links = set(), []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        told = dict(attrs)
        for name in ("id", "name"):
            if told.get(name) and (name == "id" or tag == "a"):
                self.anchors.add(told[name])
        for name in ("href", "src"):
            if told.get(name) is None or (tag == "link" and told.get("rel") in TOLD):
                continue
            self.links.append((told[name], (tag, name) in LOADED))

    handle_startendtag = handle_starttag


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(root.rglob("*.html"))}
    faults, links = [], 0
    for path, page in pages.items():
        for address, loaded in page.links:
            links += 1
            parts = urllib.parse.urlsplit(address)
            if parts.scheme or parts.netloc:
                if loaded and parts.scheme not in ("data", "javascript"):
                    faults.append(f"{path.relative_to(root)} loads {address}")
                continue
            place = urllib.parse.unquote(parts.path)
            target = path if not place else (root / place[1:] if place.startswith("/") else path.parent / place).resolve()
            if path.name == "404.html" and place.startswith("/"):
                continue  # its addresses are told when the site has a place
            if target.is_dir():
                target /= "index.html"
            anchor = urllib.parse.unquote(parts.fragment)
            if not target.is_file():
                faults.append(f"{path.relative_to(root)} leads to {address}, which is not there")
            elif anchor and target in pages and not anchor.startswith("__") and anchor not in pages[target].anchors:
                faults.append(f"{path.relative_to(root)} leads to {address}, where no such place is")
    for fault in faults:
        print(fault, file=sys.stderr)
    if not pages or faults:
        sys.exit(f"{len(faults)} of {links} links of {len(pages)} pages are wrong")
    print(f"{links} links of {len(pages)} pages lead somewhere")


if __name__ == "__main__":
    main()
