{% macro newton(change, size, free="") %}
# Newton's method. Dirichlet values come in by its first increment; a linear form takes one step, and a second one confirms it.
{% if free %}
{{ free }}
{% endif %}
for step in range(30):
{{ caller()|within -}}
{{ "    " }}if {{ change }} <= 1e-10*{{ size }}:
        break
else:
    sys.exit("Newton's method did not converge.")
{% endmacro %}
