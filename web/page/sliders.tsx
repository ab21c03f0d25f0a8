// A slider and a number for every error and every quantity of the set-up.

import { COLOURS } from "./chart";
import { NumberField } from "./number-field";
import type { Parameter } from "./plan";

const UNITS: Record<string, [string, number]> = { um: ["µm", 50], arcsec: ["″", 30], "um/m": ["µm/m", 50] };

interface Props {
  parameters: Parameter[];
  values: Record<string, number>;
  /** Takes all values, and which of them changed. */
  set: (values: Record<string, number>, changed?: string) => void;
}

export function Sliders({ parameters, values, set }: Props) {
  const slider = ({ id, unit, setup }: Parameter, index: number) => {
    const [sign, usual] = UNITS[unit] ?? [unit, 50];
    const value = values[id] ?? 0;
    // A number may lie beyond the usual ends.
    const largest = Math.max(usual, Math.abs(value));
    return (
      <div class={setup ? "slider setup" : "slider"} key={id}>
        <span class="swatch" style={{ background: COLOURS[index % COLOURS.length] }} />
        <label for={`slider-${index}`} title={id}>
          {id}
        </label>
        <input
          id={`slider-${index}`}
          type="range"
          min={-largest}
          max={largest}
          step={0.1}
          value={value}
          onInput={(event) => set({ ...values, [id]: event.currentTarget.valueAsNumber }, id)}
        />
        <NumberField label={`${id}, ${sign}`} value={value} set={(number) => set({ ...values, [id]: number }, id)} />
        <span class="unit" aria-hidden="true">
          {sign}
        </span>
      </div>
    );
  };
  const own = parameters.map((parameter, index) => [parameter, index] as const);
  const setUp = own.filter(([parameter]) => parameter.setup);
  return (
    <fieldset>
      <legend>Errors</legend>
      {own.filter(([parameter]) => !parameter.setup).map(([parameter, index]) => slider(parameter, index))}
      {setUp.length > 0 && (
        <details>
          <summary>Set-up</summary>
          {setUp.map(([parameter, index]) => slider(parameter, index))}
        </details>
      )}
      <button onClick={() => set({})}>All zero</button>
    </fieldset>
  );
}
