"""What axe-core finds on a page in a browser."""

from axe_playwright_python.sync_playwright import Axe

GRAVE = ("serious", "critical")


def findings(page, rules=()):
    """What keeps people with disabilities from using it, by these rules or all: each with the first place of it."""
    options = {"resultTypes": ["violations"]} | ({"runOnly": list(rules)} if rules else {})
    found = Axe().run(page, options=options).response["violations"]
    return [
        f"{page.url}: {one['id']}: {one['nodes'][0]['html']}: {one['nodes'][0]['failureSummary']}"
        for one in found
        if one["impact"] in GRAVE
    ]
