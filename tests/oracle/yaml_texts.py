# SPDX-License-Identifier: BSD-3-Clause
"""YAML files as nested dicts and lists whose leaves are texts."""
import functools

import yaml

LOADER = getattr(yaml, "CBaseLoader", yaml.BaseLoader)


@functools.lru_cache(maxsize=200)
def load(path):
    with open(path, encoding="utf-8") as file:
        return yaml.load(file, Loader=LOADER)
