// The curves of the tests of a plan.

import { COLOURS, type Curve } from "./chart";
import type { Description } from "./explore";

/** A call of the worker. */
export type Call = <T>(method: string, args?: unknown[]) => Promise<T>;

/** The curves of each test: the sum of all changes and each change alone, or the derivative by each error. */
export async function computedCurves(
  found: Description,
  values: Float64Array,
  kind: "patterns" | "sensitivities",
  call: Call,
): Promise<Curve[][]> {
  const errors = found.parameters.flatMap(({ setup }, j) => (setup ? [] : [j]));
  const alone = kind === "sensitivities" ? errors : [...values.keys()].filter((j) => values[j] !== 0);
  const numbers = await call<Float64Array>(kind, [values, Uint32Array.from(alone)]);
  const each = alone.map((j): Omit<Curve, "values"> => ({ colour: COLOURS[j % COLOURS.length], width: 1.2 }));
  const styles = kind === "sensitivities" ? each : [{ colour: "", width: 2 }, ...each];
  let at = 0;
  return found.tests.map((_, k) => {
    // Several coordinates of a reading are consecutive; the first is shown.
    const rows = found.abscissae[k].length;
    const coordinates = Math.max(
      1,
      Math.round(
        numbers.length / Math.max(1, styles.length * found.abscissae.reduce((sum, one) => sum + one.length, 0)),
      ),
    );
    return styles.map((style) => {
      const all = numbers.subarray(at, (at += rows * coordinates));
      return { ...style, values: coordinates === 1 ? all : all.filter((_, i) => i % coordinates === 0) };
    });
  });
}
