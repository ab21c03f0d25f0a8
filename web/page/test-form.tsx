// The set-up and the motion of a test by numbers.

import type { Key, PlannedTest } from "./explore";
import { part, value } from "./plan-text";

type Ball = "workpiece_ball_mm" | "spindle_ball_mm";

interface Props {
  tests: PlannedTest[];
  /** The keys of a test and of a motion, as the schema describes them. */
  keys: Record<string, Key>;
  motionKeys: Record<string, Key>;
  test: number;
  plan: string;
  select: (test: number) => void;
  set: (key: string, written: string) => void;
  place: (ball: Ball, written: string) => void;
  setPart: (key: string, part: string, written: string, number: number) => void;
  copy: () => void;
  remove: () => void;
}

/** Keys with inputs of their own, the name, which the list above shows, and data, which a plan does without. */
const OWN = ["name", "workpiece_ball_mm", "spindle_ball_mm", "bar_mm", "sweep", "path", "data", "format", "columns"];

/** A key as a label: `from_deg` is "from, °". */
function labelOf(key: string): string {
  const [, stem, unit] = /^(.*?)_(mm_min|deg_min|mm|deg)$/.exec(key) ?? [key, key, ""];
  const units: Record<string, string> = { mm: ", mm", deg: ", °", mm_min: ", mm/min", deg_min: ", °/min" };
  return `${stem.replaceAll("_", " ")}${units[unit] ?? ""}`;
}

/** A first value of a key, as TOML has it. */
function firstValue({ type }: Key): string {
  const first: Record<string, string> = { number: "0", integer: "1", boolean: "true", array: "[]", object: "{}" };
  return first[String(Array.isArray(type) ? type[0] : type)] ?? '""';
}

export function TestForm({
  tests,
  keys,
  motionKeys,
  test,
  plan,
  select,
  set,
  place,
  setPart,
  copy,
  remove,
}: Props) {
  const shown = tests[test] ?? tests[0];
  const motion = value(plan, test, "sweep") !== undefined ? "sweep" : "path";
  const written = value(plan, test, motion);
  const parts = Object.keys(motionKeys).filter((key) => part(written, key) !== undefined);
  const rows = [0, 3, 6].map((start) => parts.slice(start, start + 3)).filter((row) => row.length > 0);
  const others = Object.keys(keys).filter((key) => !OWN.includes(key));
  const stated = others.filter((key) => value(plan, test, key) !== undefined);
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
      {rows.map((row, k) => (
        <div class="point" key={row[0]}>
          <span>{k === 0 && `motion of ${shown.moves.join(", ")}`}</span>
          {row.map((key) => (
            <input
              key={key}
              type="number"
              step="any"
              aria-label={labelOf(key)}
              title={`${labelOf(key)}: ${motionKeys[key].description}`}
              value={part(written, key)}
              onInput={(event) => number(event, (found) => setPart(motion, key, written ?? "", found))}
            />
          ))}
        </div>
      ))}
      {stated.map((key) => (
        // What is typed stays while an analysis ends: only another value in the plan replaces it.
        <div class="point key" key={`${key} ${value(plan, test, key)}`}>
          <label for={`key-${key}`}>{key}</label>
          <input
            id={`key-${key}`}
            title={keys[key].description}
            defaultValue={value(plan, test, key)}
            onChange={(event) => event.currentTarget.value.trim() && set(key, event.currentTarget.value.trim())}
          />
        </div>
      ))}
      <select
        aria-label="Add a key"
        value=""
        onChange={(event) => {
          const key = event.currentTarget.value;
          if (key) set(key, firstValue(keys[key]));
        }}
      >
        <option value="">add a key …</option>
        {others
          .filter((key) => !stated.includes(key))
          .map((key) => (
            <option key={key} value={key} title={keys[key].description}>
              {key}
            </option>
          ))}
      </select>
    </fieldset>
  );
}
