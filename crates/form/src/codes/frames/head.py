"""{% include "head.txt" %}
python3 {{ file }} reads {{ name }}.msh and writes {{ file|replace(".py", ".vtu") }}.
"""

{% for name in imports|default([]) %}
import {{ name }}
{% endfor %}
import sys
from pathlib import Path

import numpy as np
