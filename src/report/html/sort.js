// For comfort only: tables sort by the column whose name is pressed, by the numbers behind its cells where there are any.
for (const table of document.querySelectorAll("table:not(.heat)")) {
  const heads = [...table.querySelectorAll("thead th")];
  heads.forEach((th, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...th.childNodes);
    th.replaceChildren(button);
    let up = false;
    button.addEventListener("click", () => {
      up = !up;
      const rows = [...table.tBodies[0].rows].map((row) => [row.cells[column], row]);
      const number = (cell) => (cell.dataset.v === undefined ? NaN : Number(cell.dataset.v));
      const isNumeric = rows.some(([cell]) => cell.dataset.v !== undefined);
      rows.sort(([a], [b]) => {
        const order = isNumeric ? number(a) - number(b) : a.textContent.localeCompare(b.textContent, "en", { numeric: true });
        // What has no number stands last, whichever way.
        if (Number.isNaN(order)) return Number.isNaN(number(a)) - Number.isNaN(number(b));
        return up ? order : -order;
      });
      table.tBodies[0].append(...rows.map(([, row]) => row));
      for (const other of heads) other.removeAttribute("aria-sort");
      th.setAttribute("aria-sort", up ? "ascending" : "descending");
    });
  });
}
