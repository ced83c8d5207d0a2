"""Results as pages: one for each table, and one over all of them, all of it from the records."""

from collections.abc import Sequence
from pathlib import Path

from meshshard import UsageError
from meshshard.files import publish
from meshshard_train.reproduce.experiments import TABLES
from meshshard_train.reproduce.figures import Runs, mean_and_deviation, runs_of
from meshshard_train.reproduce.plot import plot
from meshshard_train.reproduce.trials import PROTOCOLS, RUNS
from meshshard_train.tables import markdown_table

START, END = "<!-- made by meshshard reproduce -->\n", "<!-- end of what it made -->\n"
HEAD = ["", "paper", "published protocol", "goal", "honest, raw", "honest, voted", "goal"]
COLUMNS = (
    "Test accuracy in %, mean ± deviation over seeds (how many). **Paper**: its own figure. **Published protocol**: "
    "the best epoch on TEST, trained on train and validation, after 3 rounds of voting where faces are labelled. "
    "**Honest**: epoch and rounds of voting chosen on validation, test looked at once."
)


def write_pages(folder: Path) -> list[Path]:
    """Write the page and the plot of every table that has a run, and the tables in README.md; name them. UsageError:
    README.md has the mark where they begin, but not the one where they end."""
    folder.mkdir(parents=True, exist_ok=True)
    tables = {name: runs_of(folder, table) for name, table in TABLES.items()}
    begun = {name: lines for name, lines in tables.items() if any(r.records for by in lines for r in by.values())}
    readme = folder / "README.md"
    text = readme.read_text() if readme.exists() else f"# Results\n\n{START}{END}"
    before, start, rest = text.partition(START)
    _, end, after = rest.partition(END)
    if start and not end:
        raise UsageError(f"{readme} has the line {START.strip()} without {END.strip()} after its tables: put it back")
    for name, lines in begun.items():
        plot(folder / f"{name}.png", TABLES[name].title, lines)
        publish(folder / f"{name}.md", page_of(name, lines).encode())
    publish(readme, f"{before}{START}{_overview(begun)}{END}{after}".encode())
    return [*(folder / f"{name}.{kind}" for name in begun for kind in ("md", "png")), readme]


def page_of(name: str, lines: Sequence[dict[str, Runs]]) -> str:
    """One table, and every run that it is made of."""
    table = TABLES[name]
    return (
        "\n\n".join(
            [
                f"# {table.title}",
                table.about,
                COLUMNS,
                markdown_table([HEAD, *map(_row, lines)]),
                f"![{table.title}: accuracy of every run beside the paper's]({name}.png)",
                f"## Every run\n\n`make reproduce TABLE={name}` makes them; a record holds the settings, the sums "
                "of splits and shards, the machine and the commands of one run.",
                markdown_table(_every_run(lines)),
            ]
        )
        + "\n"
    )


def _overview(tables: dict[str, list[dict[str, Runs]]]) -> str:
    """The tables, without their runs."""
    parts = [COLUMNS] if tables else []
    for name, lines in tables.items():
        parts += [f"## [{TABLES[name].title}]({name}.md)", markdown_table([HEAD, *map(_row, lines)])]
    return "".join(f"{part}\n\n" for part in parts)


def _row(by_protocol: dict[str, Runs]) -> list[str]:
    published, honest = by_protocol["published"], by_protocol["honest"]
    return [
        published.line.name,
        _number(published.line.paper),
        mean_and_deviation(published.values(published.figure)),
        _goal(published),
        mean_and_deviation(honest.values("accuracy")),
        mean_and_deviation(honest.values("voted_accuracy")),
        _goal(honest),
    ]


def _goal(runs: Runs) -> str:
    values = runs.values(runs.figure)
    if runs.goal is None:
        return "stated"
    if not values:
        return f"{runs.goal:.1f}"
    return f"{runs.goal:.1f} {'reached' if sum(values) / len(values) >= runs.goal else 'missed'}"


def _every_run(lines: Sequence[dict[str, Runs]]) -> list[list[str]]:
    head = ["", "protocol", "seed", "val, raw", "test, raw", "test, voted", "epoch", "rounds", "hours", "record"]
    rows = []
    for by_protocol in lines:
        for protocol in PROTOCOLS:
            for record in by_protocol[protocol].records:
                results = record["results"]
                val, test = results["rows"].get("val", {}), results["rows"]["test"]
                figures = [val.get("accuracy"), test["accuracy"], test.get("voted_accuracy")]
                rows.append(
                    [
                        by_protocol[protocol].line.name,
                        protocol,
                        str(record["seed"]),
                        *(_number(None if value is None else 100 * value, 2) for value in figures),
                        f"{results['epoch']} of {results['epochs']}",
                        str(results["voting_rounds"]) if "voted_accuracy" in test else "-",
                        f"{record['hours']:.2f}",
                        f"[JSON]({RUNS}/{record['name']}.json)",
                    ]
                )
    return [head, *rows]


def _number(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
