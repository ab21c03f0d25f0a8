// What a session was read as.

export interface Checked {
  machine: string;
  instrument: string;
  tests: { name: string; readings: number; moves: boolean }[];
  effects: string[];
  warnings: string[];
}

/** From here on the time of a trace on one processor matters. */
const MANY_READINGS = 50_000;

export function Summary({ checked }: { checked: Checked }) {
  const readings = checked.tests.reduce((sum, test) => sum + test.readings, 0);
  return (
    <div class="summary">
      <p>
        {checked.machine}, {checked.instrument}: {checked.tests.map((test) => test.name).join(", ")};{" "}
        {readings ? `${readings} readings` : "a plan without readings"}
        {checked.effects.length > 0 && `; declared effects: ${checked.effects.join(", ")}`}
      </p>
      {readings > MANY_READINGS && (
        <p class="note">A trace of so many readings takes minutes: the page computes on one processor, the command on all.</p>
      )}
      {checked.warnings.length > 0 && (
        <ul class="warning">
          {checked.warnings.map((warning) => (
            <li key={warning}>{warning}</li>
          ))}
        </ul>
      )}
    </div>
  );
}
