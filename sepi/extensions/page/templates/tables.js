"use strict";

/* Tables that sort by a click on a column's heading: up, down, and back to the order of the paper. */

Sepi.sortable = (table) => {
  const body = table.tBodies[0];
  const original = [...body.rows];
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    head.querySelector("button")?.addEventListener("click", () => {
      const next = { none: "ascending", ascending: "descending", descending: "none" };
      const order = next[head.getAttribute("aria-sort") ?? "none"];
      for (const other of heads) other.setAttribute("aria-sort", "none");
      head.setAttribute("aria-sort", order);
      body.append(...(order === "none" ? original : Sepi.sorted(original, column, order)));
    });
  });
};

/** Rows by a column; averages and rows without a figure there stay at the end. */
Sepi.sorted = (rows, column, order) => {
  const sign = order === "ascending" ? 1 : -1;
  const numeric = rows.some((row) => row.cells[column].dataset.value !== undefined);
  const empty = ({ dataset, textContent }) => (numeric ? dataset.value === undefined : !textContent.trim());
  const last = (row) => (row.dataset.kind?.startsWith("average") ? 2 : empty(row.cells[column]) ? 1 : 0);
  const compare = (one, other) => {
    const [a, b] = [one.cells[column].dataset, other.cells[column].dataset];
    if (a.value !== undefined && b.value !== undefined) return a.value - b.value;
    return one.cells[column].textContent.localeCompare(other.cells[column].textContent, "en", { numeric: true });
  };
  return [...rows].sort(
    (one, other) => last(one) - last(other) || (last(one) === 2 ? 0 : sign * compare(one, other)),
  );
};

document.querySelectorAll("table.sortable").forEach(Sepi.sortable);
