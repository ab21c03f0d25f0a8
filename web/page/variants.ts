// Other guesses of a layout, to see what they do to the residual.

import type { Layout, Own } from "./layout";

export interface Variant {
  words: string;
  layout: Layout;
}

export function variants(layout: Layout, own: Own[]): Variant[] {
  const found: Variant[] = [];
  const decimal = layout.decimal === "." ? "," : ".";
  found.push({ words: `decimal ${decimal === "," ? "comma" : "point"}`, layout: { ...layout, decimal } });
  layout.columns.forEach((name, k) => {
    const column = own.find(({ stem, units }) => units.some((unit) => name === `${stem}_${unit}`));
    if (!name || !column || column.stem === "time") return;
    const unit = name.slice(column.stem.length + 1);
    const other = (next: string) => ({ ...layout, columns: layout.columns.map((old, i) => (i === k ? next : old)) });
    // The unit that is most often mistaken for this one.
    const next = column.units.find((one) => one !== unit);
    if (next)
      found.push({
        words: `column ${k + 1} is ${column.stem}_${next}, not ${name}`,
        layout: other(`${column.stem}_${next}`),
      });
    // A length and a deviation from it are often mistaken for one another.
    for (const [one, two] of [
      ["length", "deviation"],
      ["deviation", "length"],
    ]) {
      if (column.stem === one && own.some(({ stem }) => stem === two)) {
        found.push({ words: `column ${k + 1} is ${two}_${unit}, not ${name}`, layout: other(`${two}_${unit}`) });
      }
    }
  });
  return found;
}
