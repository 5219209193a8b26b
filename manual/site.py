"""What the site needs besides docs/: a front page, and the files that pages link to.

Hooks of `mkdocs.yml`. The front page is the README. On a site a link out of `docs/` leads nowhere,
so each file behind such a link becomes a page of its own, below `source/`.
"""

import posixpath
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

ROOT: Final = Path(__file__).parents[1]
LINK: Final = re.compile(r"(?P<open>\]\()(?P<path>[^)#\s:]+)(?P<rest>#[^)\s]*)?(?=\))")
PAGES: Final = {"README.md": "index.md", "CHANGELOG.md": "changelog.md"}
"""Files besides docs/ that are pages as they are."""
FOLDERS: Final = {"asp": "reference/rules.md", "docs/decisions": "decisions/README.md"}
"""Where a link to a folder leads."""
LEXERS: Final = {".lp": "prolog", ".toml": "toml", ".py": "python"}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the front page, the changelog and a page for each file that a page links to."""
    for name, page in PAGES.items():
        text = (ROOT / name).read_text(encoding="utf-8")
        files.append(File.generated(config, page, content=text))
    sources = {
        target
        for file in files.documentation_pages()
        for target in _targets(file.src_uri, file.content_string)
        if _site_path(target).startswith("source/")
    }
    for source in sorted(sources):
        files.append(_source_page(source, config))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn links between files of the checkout into links between pages of the site."""
    del config, files
    here = page.file.src_uri

    def moved(link: re.Match[str]) -> str:
        target = _site_path(_target(here, link["path"]))
        way = posixpath.relpath(target, posixpath.dirname(here) or ".")
        return f"{link['open']}{way}{link['rest'] or ''}"

    return LINK.sub(moved, markdown)


def _targets(page: str, markdown: str) -> Iterator[str]:
    for link in LINK.finditer(markdown):
        yield _target(page, link["path"])


def _target(page: str, path: str) -> str:
    """Return the file of the checkout that a link of a page of the site means."""
    origin = next((name for name, made in PAGES.items() if made == page), f"docs/{page}")
    return posixpath.normpath(posixpath.join(posixpath.dirname(origin), path))


def _site_path(target: str) -> str:
    """Return the page or file of the site that stands for a file of the checkout."""
    if target in PAGES:
        return PAGES[target]
    if target in FOLDERS:
        return FOLDERS[target]
    if target.startswith("docs/"):
        return target.removeprefix("docs/")
    return f"source/{target}.md"


def _source_page(name: str, config: MkDocsConfig) -> File:
    path = ROOT / name
    if not path.is_file():
        raise PluginError(f"{name}: a page links to it, and it is no file; see manual/site.py")
    lexer = LEXERS.get(path.suffix, "text")
    content = f"# {name}\n\n~~~~{lexer}\n{path.read_text(encoding='utf-8')}~~~~\n"
    return File.generated(
        config, f"source/{name}.md", content=content, inclusion=InclusionLevel.NOT_IN_NAV
    )
