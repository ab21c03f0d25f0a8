// The set-up and the motion of a test by numbers.

import { NumberField } from "./number-field";
import type { Description, Key } from "./plan";
import { type Field, part, value } from "./plan-text";

type Ball = "workpiece_ball_mm" | "spindle_ball_mm";

interface Props {
  description: Description;
  test: number;
  plan: string;
  /** The field that makes the plan unusable, and why. */
  fault?: { field: Field; why: string };
  select: (test: number) => void;
  set: (key: string, written: string) => void;
  place: (ball: Ball, written: string, coordinate: string) => void;
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

export function TestForm({ description, test, plan, fault, select, set, place, setPart, copy, remove }: Props) {
  const { tests, test_keys: keys, motion_keys: motionKeys } = description;
  const shown = tests[test] ?? tests[0];
  const motion = value(plan, test, "sweep") !== undefined ? "sweep" : "path";
  const written = value(plan, test, motion);
  const parts = Object.keys(motionKeys).filter((key) => part(written, key) !== undefined);
  const rows = [0, 3, 6].map((start) => parts.slice(start, start + 3)).filter((row) => row.length > 0);
  const others = Object.keys(keys).filter((key) => !OWN.includes(key));
  const stated = others.filter((key) => value(plan, test, key) !== undefined);
  const at = fault && fault.field.test === test ? shownField(fault.field, motion, parts, stated) : undefined;
  const why = (field: string) => (at === field ? fault?.why : undefined);
  const point = (label: string, ball: Ball, from: readonly number[]) => (
    <div class="point">
      <span>{label}</span>
      {["x", "y", "z"].map((coordinate, k) => (
        <NumberField
          key={coordinate}
          label={`${label} ${coordinate}, mm`}
          value={Number(from[k].toFixed(4))}
          of={description}
          fault={why(`${ball}.${coordinate}`)}
          set={(mm) => place(ball, `[${from.map((old, i) => (i === k ? mm : old)).join(", ")}]`, coordinate)}
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
      <Why of={why("")} />
      {shown.table_point_mm && point("table ball, mm", "workpiece_ball_mm", shown.table_point_mm)}
      {shown.bar_mm !== null && point("tool ball, mm", "spindle_ball_mm", shown.tool_point_mm)}
      {shown.bar_mm !== null && (
        <div class="point key">
          <label for="bar">bar, mm</label>
          <NumberField
            id="bar"
            value={Number(shown.bar_mm.toFixed(4))}
            of={description}
            refused={(mm) => (mm > 0 ? undefined : "a bar is longer than 0")}
            fault={why("bar_mm")}
            set={(mm) => set("bar_mm", String(mm))}
          />
        </div>
      )}
      {rows.map((row, k) => (
        <div class="point" key={row[0]}>
          {/* Each field has its name for screen readers. */}
          <span>{k === 0 && `motion of ${shown.moves.join(", ")}`}</span>
          {[0, 1, 2].map((column) => (
            <span key={column} class="unit" aria-hidden="true">
              {row[column] && labelOf(row[column])}
            </span>
          ))}
          <span />
          {row.map((key) => (
            <NumberField
              key={key}
              label={labelOf(key)}
              title={`${labelOf(key)}: ${motionKeys[key].description}`}
              value={part(written, key)}
              of={description}
              fault={why(`${motion}.${key}`)}
              set={(found) => setPart(motion, key, written ?? "", found)}
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
            aria-invalid={why(key) ? true : undefined}
            aria-describedby={why(key) ? `why-${key}` : undefined}
            defaultValue={value(plan, test, key)}
            onChange={(event) => event.currentTarget.value.trim() && set(key, event.currentTarget.value.trim())}
          />
          <Why of={why(key)} id={`why-${key}`} />
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

/** The field of this form that stands for a field of the text; empty for the test as a whole. */
function shownField({ key, part }: Field, motion: string, parts: string[], stated: string[]): string {
  if (key === "workpiece_ball_mm" || key === "spindle_ball_mm") return `${key}.${part ?? "x"}`;
  if (key === motion && parts.length > 0) return `${key}.${part && parts.includes(part) ? part : parts[0]}`;
  return key !== undefined && (key === "bar_mm" || stated.includes(key)) ? key : "";
}

function Why({ of, id }: { of?: string; id?: string }) {
  return of ? (
    <span class="why" id={id}>
      {of}
    </span>
  ) : null;
}
