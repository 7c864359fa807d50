"""{% include "head.txt" %}
python3 {{ file }} reads {{ name }}.msh and writes {{ file|replace(".py", ".vtu") }}.
"""

import sys
from pathlib import Path

import numpy as np
