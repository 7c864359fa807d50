{% macro rows(texts, count) %}
[
{% for row in texts|batch(count) %}
    {{ row|join(", ") }},
{% endfor %}
]
{%- endmacro %}
