"""Summaries as static HTML with inline SVG, so that they survive the export of a notebook."""

from __future__ import annotations

import html

from ._report import ROWS, counted, digits_of, headline, label_of, sentences, table
from ._reported import to_html
from ._summary import MetricStats, QualityStats, Summary

_BEFORE, _AFTER = "#b0b0b0", "#2a7ab9"


def _svg(*series: tuple[str, MetricStats]) -> str:
    """Histograms one over the other, each relative to its own number of elements."""
    width, height = 240, 60
    shapes = []
    highest = max(max(stats.histogram, default=0) for _, stats in series) or 1
    for colour, stats in series:
        count = len(stats.histogram) or 1
        step = width / count
        points = [f"0,{height}"]
        for index, number in enumerate(stats.histogram):
            top = height - height * number / highest
            points += [f"{index * step:.1f},{top:.1f}", f"{(index + 1) * step:.1f},{top:.1f}"]
        points.append(f"{width},{height}")
        shapes.append(
            f'<polygon points="{" ".join(points)}" fill="{colour}" fill-opacity="0.5" '
            f'stroke="{colour}"/>'
        )
    first = series[0][1]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height + 14}" '
        f'role="img" aria-label="histogram of {label_of(first.metric)}">{"".join(shapes)}'
        f'<text x="0" y="{height + 12}" font-size="10">{first.histogram_lower:g}</text>'
        f'<text x="{width}" y="{height + 12}" font-size="10" text-anchor="end">'
        f"{first.histogram_upper:g}</text></svg>"
    )


def _html_table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    def row(tag: str, cells: tuple[str, ...]) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    return "<table>" + row("th", head) + "".join(row("td", cells) for cells in rows) + "</table>"


@to_html.register
def summary_html(summary: Summary) -> str:
    """Returns a summary as a fragment of HTML."""
    parts = [f"<p><b>{html.escape(headline(summary))}</b></p>"]
    if rows := table(summary):
        parts.append(_html_table(("metric", "", "before", "after"), list(rows)))
    for name, _ in ROWS:
        before = summary.quality_before.find_metric(name)
        after = summary.quality_after.find_metric(name)
        if before is not None and after is not None:
            parts.append(
                f'<figure style="display:inline-block;margin:4px">'
                f"{_svg((_BEFORE, before), (_AFTER, after))}<figcaption>{label_of(name)}, before "
                f'<span style="color:{_BEFORE}">■</span> and after '
                f'<span style="color:{_AFTER}">■</span></figcaption></figure>'
            )
    items = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in sentences(summary))
    return "".join(parts) + f"<ul>{items}</ul>"


@to_html.register
def quality_html(stats: QualityStats) -> str:
    """Returns a quality report as a fragment of HTML."""
    rows: list[tuple[str, ...]] = []
    figures = []
    for metric in stats.metrics:
        if not metric.element_count:
            continue
        digits = digits_of(metric.metric)
        values = (metric.min, metric.percentile_1, metric.mean, metric.max)
        rows.append((label_of(metric.metric), *(f"{value:.{digits}f}" for value in values)))
        figures.append(
            f'<figure style="display:inline-block;margin:4px">{_svg((_AFTER, metric))}'
            f"<figcaption>{label_of(metric.metric)}</figcaption></figure>"
        )
    head = f"<p><b>{counted(stats.element_count, 'element')}</b>, "
    head += f"{stats.inverted_element_count:,} inverted</p>"
    return head + _html_table(("metric", "min", "1 %", "mean", "max"), rows) + "".join(figures)
