"""{% include "head.txt" %}
python3 {{ file }} reads {{ mesh }} and writes {{ file|replace(".py", ".vtu") }}.
"""

{% for name in imports|default([]) %}
import {{ name }}
{% endfor %}
import sys
from pathlib import Path

import numpy as np
