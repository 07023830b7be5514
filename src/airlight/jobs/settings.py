"""Writes the settings of a run, as they are kept in what it writes and taken up again by `--settings-from`."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from airlight.jobs.light_text import LightText
from airlight.options import declared
from airlight.options.declare import as_text


@dataclass(frozen=True)
class Settings:
    """Holds what shapes a result.

    values: of declared parameters. standing: the defaults that a scene has of its own. others: of options beside these, by name, with
    their defaults. preset: its name. lists: of texts, by name.
    """

    values: Mapping[str, Any]
    others: Mapping[str, Any] = field(default_factory=dict)
    defaults: Mapping[str, Any] = field(default_factory=dict)
    preset: str | None = None
    standing: Mapping[str, Any] = field(default_factory=dict)
    lists: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def text(self, lights: Sequence[LightText] = (), look: str | None = None, **instead: Any) -> str:
        """Write a line of JSON: what is not a default, the lights as they were resolved, the preset's name.

        look: of a picture. instead: values of other options that go before those that hold for all frames.
        """
        defaults = {one.name: one.default for one in declared(scenes=True)} | dict(self.standing)
        found = {name: as_text(v) if isinstance(v, tuple) else v for name, v in self.values.items() if v != defaults[name]}
        for name, value in (dict(self.others) | instead).items():
            is_unset = value is False and self.defaults[name] is not True  # a flag that is not set
            if value is not None and value != self.defaults[name] and not is_unset:
                found[name] = value
        found |= {name: list(texts) for name, texts in self.lists.items() if texts}
        for name, parallel in (("light", False), ("angle", True)):
            texts = [light.text for light in lights if (light.angle is not None) == parallel]
            found |= {name: texts} if texts else {}
        if look is not None:
            found["look"] = look
        return json.dumps(found | ({"preset": self.preset} if self.preset else {}), sort_keys=True, default=str)
