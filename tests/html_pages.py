"""What tests read of HTML pages, and names that try to break them."""

from html.parser import HTMLParser

HOSTILE = "<script>alert('x')</script>\"><img src=http://evil onerror=alert(1)> {{ 7 * 7 }} &amp; [bold]"


TAGS = {
    *("html", "head", "meta", "title", "style", "body", "main", "h1", "h2", "p", "div", "span", "strong", "ul", "li"),
    *("table", "thead", "tbody", "tr", "th", "td", "figure", "figcaption", "img", "svg", "rect"),
}


class Page(HTMLParser):
    """Tags with attributes, cells of tables row by row, and all text."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.rows, self.text, self.cell = [], [], [], False
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.cell = True
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        self.cell = self.cell and tag not in ("td", "th")

    def handle_data(self, data):
        self.text.append(data)
        if self.cell:
            self.rows[-1][-1] += data

    def named(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]
