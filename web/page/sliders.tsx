// A slider for every error and every quantity of the set-up.

import { COLOURS } from "./chart";
import type { Parameter } from "./explore";

const UNITS: Record<string, [string, number]> = { um: ["µm", 50], arcsec: ["″", 30], "um/m": ["µm/m", 50] };

interface Props {
  parameters: Parameter[];
  values: Record<string, number>;
  set: (values: Record<string, number>) => void;
}

export function Sliders({ parameters, values, set }: Props) {
  const slider = ({ id, unit, setup }: Parameter, index: number) => {
    const [sign, largest] = UNITS[unit] ?? [unit, 50];
    const value = values[id] ?? 0;
    return (
      <div class="slider" key={id}>
        <span class="swatch" style={{ background: COLOURS[index % COLOURS.length] }} />
        <label
          for={`slider-${index}`}
          title={id}
          style={setup ? { fontSize: "0.75rem", overflowWrap: "anywhere" } : {}}
        >
          {id}
        </label>
        <input
          id={`slider-${index}`}
          type="range"
          min={-largest}
          max={largest}
          step={0.1}
          value={value}
          onInput={(event) => set({ ...values, [id]: event.currentTarget.valueAsNumber })}
        />
        <output for={`slider-${index}`}>
          {value.toFixed(1)} {sign}
        </output>
      </div>
    );
  };
  const own = parameters.map((parameter, index) => [parameter, index] as const);
  return (
    <fieldset>
      <legend>Errors</legend>
      {own.filter(([parameter]) => !parameter.setup).map(([parameter, index]) => slider(parameter, index))}
      <details>
        <summary>Set-up</summary>
        {own.filter(([parameter]) => parameter.setup).map(([parameter, index]) => slider(parameter, index))}
      </details>
      <button onClick={() => set({})}>All zero</button>
    </fieldset>
  );
}
