"""The style is told which cells of a table are brief and which are long."""

from documentation.tables import BRIEF, LONG, with_lengths


def test_cells_and_names_are_marked_by_their_letters():
    name, words = "BipedHiddenFriction-v0", "w" * (LONG + 1)
    html = f'<td><code>UGVBump-v1</code></td><td style="text-align: right;">{words}</td>'
    assert with_lengths(html) == (
        '<td class="brief"><code class="brief">UGVBump-v1</code></td>'
        f'<td class="long" style="text-align: right;">{words}</td>'
    )
    assert len(name) > BRIEF
    assert with_lengths(f"<td><code>{name}</code></td>") == f"<td><code>{name}</code></td>"


def test_tags_and_entities_are_no_letters():
    link = f'<td><a href="{"x" * 80}">&lt;&lt;{"y" * (BRIEF - 2)}</a></td>'
    assert with_lengths(link).startswith('<td class="brief">')
