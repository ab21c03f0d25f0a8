// The charts of a plan: one for each test, and for each coordinate of its readings.

import { useState } from "preact/hooks";
import { Chart, type Curve } from "./chart";
import type { Description } from "./explore";

interface Props {
  description: Description;
  /** By test and coordinate. */
  curves: Curve[][][];
  kind: "patterns" | "sensitivities";
  drawn: () => void;
}

export function Charts({ description, curves, kind, drawn }: Props) {
  const [chosen, setChosen] = useState("");
  const names = [...new Set(description.tests.flatMap(({ coordinates }) => coordinates))];
  // Another plan has other coordinates.
  const shown = names.includes(chosen) ? chosen : "";
  const charts = description.tests.flatMap((test, k) =>
    test.coordinates.map((name, coordinate) => ({ test, k, name, coordinate })),
  );
  return (
    <>
      {names.length > 1 && (
        <p class="actions">
          <label>
            Coordinate{" "}
            <select aria-label="Coordinate" value={shown} onChange={(event) => setChosen(event.currentTarget.value)}>
              <option value="">all</option>
              {names.map((name) => (
                <option key={name}>{name}</option>
              ))}
            </select>
          </label>
        </p>
      )}
      <div class="charts">
        {charts
          .filter(({ name }) => shown === "" || name === shown)
          .map(({ test, k, name, coordinate }) => (
            <Chart
              key={`${test.name} ${name}`}
              title={test.coordinates.length > 1 ? `${test.name} ${name}` : test.name}
              x={description.abscissae[k]}
              curves={curves[k]?.[coordinate] ?? []}
              axis={test.moves[0] ?? ""}
              unit={kind === "patterns" ? "µm" : "µm per unit"}
              drawn={drawn}
            />
          ))}
      </div>
    </>
  );
}
