"""Parts of pages that scripts write: what stands between a comment with their name and the comment end."""

from pathlib import Path


def parts(path: Path, mark: str) -> tuple[str, str, str]:
    """What is before and with the comment `mark`, the part, and what is with and after the comment end."""
    head, start, rest = path.read_text(encoding="utf-8").partition(f"<!-- {mark} -->\n")
    part, end, after = rest.partition("<!-- end -->")
    if not start or not end:
        raise SystemExit(f"{path} has no comments <!-- {mark} --> and <!-- end -->")
    return head + start, part, end + after


def put(path: Path, mark: str, text: str) -> None:
    head, _, after = parts(path, mark)
    path.write_text(head + text + after, encoding="utf-8")
