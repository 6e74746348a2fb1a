"""Results of a command as JSON: tables whose columns have units, and facts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from stickslip.records.table import Table, json_text


@dataclass(frozen=True)
class Content:
    """tables: by name, of numbers and words as they are, not as they are shown. facts: anything
    else that JSON knows, arrays included. units: of numbers among the facts, by their names.
    status: exit status of the command.
    """

    tables: Mapping[str, Table] = field(default_factory=dict)
    facts: Mapping[str, object] = field(default_factory=dict)
    units: Mapping[str, object] = field(default_factory=dict)
    status: int = 0

    def json(self, command: str) -> str:
        """Tables as lists of rows, `units` by table and column ("-": none), then the facts.

        null: what is not defined or not finite. Keys are the columns' names.
        """
        units = {name: _units(table) for name, table in self.tables.items()}
        rows = {name: _rows(table) for name, table in self.tables.items()}
        head = {"command": command, "exit_status": self.status, "units": units | dict(self.units)}
        return json_text(head | rows | dict(self.facts))


def _units(table: Table) -> dict[str, str]:
    return {column.name: column.unit for column in table.columns}


def _rows(table: Table) -> Sequence[Mapping[str, object]]:
    names = [column.name for column in table.columns]
    return [dict(zip(names, row, strict=True)) for row in table.rows]
