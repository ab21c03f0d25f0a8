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

/** What a page that is not isolated can do: the service worker of the first visit isolates the next. */
const next = () =>
  "serviceWorker" in navigator && navigator.serviceWorker.controller
    ? "reload it, which keeps your work, for all processors"
    : "the command on all";

export function Summary({ checked }: { checked: Checked }) {
  const readings = checked.tests.reduce((sum, test) => sum + test.readings, 0);
  return (
    <div class="summary">
      <p>
        {checked.machine}, {checked.instrument}: {checked.tests.map((test) => test.name).join(", ")};{" "}
        {readings ? `${readings} readings` : "a plan without readings"}
        {checked.effects.length > 0 && `; declared effects: ${checked.effects.join(", ")}`}
      </p>
      {readings > MANY_READINGS && !crossOriginIsolated && (
        <p class="note">A trace of so many readings takes a minute or more: the page computes on one processor; {next()}.</p>
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
