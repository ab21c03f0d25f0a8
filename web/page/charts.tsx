// The charts of a plan: one for each test, and for each coordinate of its readings.

import { useEffect, useRef, useState } from "preact/hooks";
import { Chart, type Curve } from "./chart";
import type { Description } from "./plan";

interface Props {
  description: Description;
  /** By test and coordinate. */
  curves: Curve[][][];
  kind: "patterns" | "sensitivities";
  /** The chosen test. */
  test: number;
  /** Whether the charts stand side by side and are scrolled. */
  scrolls: boolean;
  drawn: () => void;
}

export function Charts({ description, curves, kind, test: chosenTest, scrolls, drawn }: Props) {
  const [chosen, setChosen] = useState("");
  const strip = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const own = strip.current?.querySelector<HTMLElement>(`[data-test="${chosenTest}"]`);
    if (scrolls && strip.current && own) strip.current.scrollLeft = own.offsetLeft - strip.current.offsetLeft;
  }, [chosenTest, scrolls]);
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
      {/* What is scrolled is reached by keyboard. */}
      <div ref={strip} class="charts" role="group" aria-label="Charts of the tests" tabIndex={scrolls ? 0 : undefined}>
        {charts
          .filter(({ name }) => shown === "" || name === shown)
          .map(({ test, k, name, coordinate }) => (
            <Chart
              key={`${test.name} ${name}`}
              test={k}
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
