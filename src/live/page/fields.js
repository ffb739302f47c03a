// Text fields that hold numbers in centimetres: what is typed is read here, and a refusal stands at the field that it is about.

// A number, with a comma or a point, with or without its unit; null for anything else. `open`: "inf" is one, too.
export function centimetres(text, open = false) {
  const plain = text.trim().replace(/\s*cm$/i, "").replace(",", ".");
  if (open && ["inf", "∞"].includes(plain.toLowerCase())) return Infinity;
  return /^[+-]?(\d+\.?\d*|\.\d+)$/.test(plain) ? Number(plain) : null;
}

// Several numbers between separators; null if one of them is not a number.
export function several(text, separators, open = false) {
  const numbers = text.split(separators).filter((part) => part.trim() !== "").map((part) => centimetres(part, open));
  return numbers.includes(null) ? null : numbers;
}

export const isRefused = (field) => field.getAttribute("aria-invalid") === "true";

// Marks a field and writes the reason below its row; what was typed stays, so that it can be mended. Escape restores `kept`.
export function refuse(field, sentence, kept) {
  accept(field);
  const row = field.closest("tr") ?? field.closest(".row");
  const reason = Object.assign(document.createElement("p"), { className: "error", id: `${field.id}-error` });
  reason.setAttribute("role", "alert");
  reason.textContent = `${sentence}. ${kept === "" ? "It stays empty" : `It stays ${kept}`}; Escape restores it.`;
  if (row.tagName === "TR") {
    const cell = Object.assign(document.createElement("td"), { colSpan: row.cells.length });
    const line = Object.assign(document.createElement("tr"), { className: "reason" });
    cell.append(reason);
    line.append(cell);
    row.after(line);
  } else {
    row.after(reason);
  }
  field.setAttribute("aria-invalid", "true");
  field.setAttribute("aria-describedby", reason.id);
  reason.scrollIntoView({ block: "nearest" });
}

// Takes the mark and the reason away.
export function accept(field) {
  field.removeAttribute("aria-invalid");
  field.removeAttribute("aria-describedby");
  const reason = document.getElementById(`${field.id}-error`);
  (reason?.closest("tr.reason") ?? reason)?.remove();
}

// Removes all marks, before the fields show other values.
export function acceptAll() {
  document.querySelectorAll('[aria-invalid="true"]').forEach(accept);
}

// Calls `take(text)` for what is typed, and restores `kept()` on Escape.
export function onTyped(field, take, kept) {
  field.addEventListener("change", () => take(field.value.trim()));
  field.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    accept(field);
    field.value = kept();
  });
}
