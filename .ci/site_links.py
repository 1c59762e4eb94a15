"""A hook of mkdocs. Pages are written for readers of the source tree: links that leave docs/ are relative. On the site they lead to
the repository; one that leads nowhere fails the build. Blocks such as `sh data` are shown as `sh`."""
import logging
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent
LOG = logging.getLogger("mkdocs.hooks.site_links")
LINK = re.compile(r"\]\((\.\./[^)\s#]+)(#[^)\s]*)?\)")


def on_page_markdown(markdown, page, config, files):
    folder = (ROOT / "docs" / page.file.src_uri).parent

    def outside(found):
        target = (folder / found[1]).resolve()
        if target.is_relative_to(ROOT / "docs"):
            return found[0]
        if not target.exists():
            LOG.warning("%s: %s leads nowhere", page.file.src_uri, found[1])
            return found[0]
        kind = "tree" if target.is_dir() else "blob"
        return f"]({config.repo_url.rstrip('/')}/{kind}/main/{target.relative_to(ROOT).as_posix()}{found[2] or ''})"

    markdown = LINK.sub(outside, markdown)
    return re.sub(r"^(\s*```)(sh|rust)[ ,][a-z0-9_,]+$", r"\1\2", markdown, flags=re.MULTILINE)
