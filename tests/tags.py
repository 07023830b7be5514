"""What an HTML page holds."""

import html.parser


class Tags(html.parser.HTMLParser):
    """Every tag closed, and what is loaded."""

    def __init__(self):
        super().__init__()
        self.open, self.loaded, self.rows = [], [], 0

    def handle_starttag(self, tag, attributes):
        self.loaded += [value for name, value in attributes if name in ("src", "href", "srcset", "data", "action")]
        self.rows += tag == "tr"
        if tag not in ("meta", "img", "link", "input"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
