// The set-up and the motion of a test by numbers.

import type { PlannedTest } from "./explore";
import { part, value } from "./plan-text";

type Ball = "workpiece_ball_mm" | "spindle_ball_mm";

interface Props {
  tests: PlannedTest[];
  test: number;
  plan: string;
  select: (test: number) => void;
  set: (key: string, written: string) => void;
  place: (ball: Ball, written: string) => void;
  setPart: (key: string, part: string, written: string, number: number) => void;
  copy: () => void;
  remove: () => void;
}

const PARTS: [string, string][] = [
  ["from_deg", "from, °"],
  ["to_deg", "to, °"],
  ["step_deg", "step, °"],
  ["from_mm", "from, mm"],
  ["to_mm", "to, mm"],
  ["step_mm", "step, mm"],
  ["radius_mm", "radius, mm"],
];

export function TestForm({ tests, test, plan, select, set, place, setPart, copy, remove }: Props) {
  const shown = tests[test] ?? tests[0];
  const motion = value(plan, test, "sweep") !== undefined ? "sweep" : "path";
  const written = value(plan, test, motion);
  const parts = PARTS.filter(([key]) => part(written, key) !== undefined);
  const number = (event: { currentTarget: HTMLInputElement }, act: (number: number) => void) => {
    const found = event.currentTarget.valueAsNumber;
    if (Number.isFinite(found)) act(found);
  };
  const point = (label: string, ball: Ball, at: readonly number[]) => (
    <div class="point">
      <span>{label}</span>
      {["x", "y", "z"].map((coordinate, k) => (
        <input
          key={coordinate}
          type="number"
          step="any"
          aria-label={`${label} ${coordinate}, mm`}
          value={Number(at[k].toFixed(4))}
          onInput={(event) =>
            number(event, (mm) => place(ball, `[${at.map((old, i) => (i === k ? mm : old)).join(", ")}]`))
          }
        />
      ))}
    </div>
  );
  return (
    <fieldset>
      <legend>Test</legend>
      <p class="actions">
        <select aria-label="Test" value={test} onChange={(event) => select(Number(event.currentTarget.value))}>
          {tests.map((one, k) => (
            <option key={one.name} value={k}>
              {one.name}: {one.readings} readings
            </option>
          ))}
        </select>
        <button onClick={copy}>Copy</button>
        <button onClick={remove} disabled={tests.length < 2}>
          Remove
        </button>
      </p>
      {shown.table_point_mm && point("table ball, mm", "workpiece_ball_mm", shown.table_point_mm)}
      {shown.bar_mm !== null && point("tool ball, mm", "spindle_ball_mm", shown.tool_point_mm)}
      {shown.bar_mm !== null && (
        <div class="point">
          <label for="bar">bar, mm</label>
          <input
            id="bar"
            type="number"
            step="any"
            value={Number(shown.bar_mm.toFixed(4))}
            onInput={(event) => number(event, (mm) => mm > 0 && set("bar_mm", String(mm)))}
          />
        </div>
      )}
      {written !== undefined && parts.length > 0 && (
        <div class="point">
          <span>motion of {shown.moves.join(", ")}</span>
          {parts.slice(0, 3).map(([key, label]) => (
            <input
              key={key}
              type="number"
              step="any"
              aria-label={label}
              title={label}
              value={part(written, key)}
              onInput={(event) => number(event, (found) => setPart(motion, key, written, found))}
            />
          ))}
        </div>
      )}
    </fieldset>
  );
}
