// Predicted uncertainty, rank, null space and confounded errors of a plan.

import { Scroll } from "./scroll";

export interface Analysis {
  // Of lengths, or of angles if all readings are angles.
  noise_um?: number;
  noise_arcsec?: number;
  readings: number;
  rank: number;
  parameter_count: number;
  errors: { id: string; meaning: string; unit: string; u: number | null; conditional_u: number | null }[];
  unidentifiable: { combination: Record<string, number> | [string, number][]; why: string }[];
  determined_by_prior: { error: string; why: string }[];
  nearly_collinear: { condition_index: number; combination: [string, number][]; why: string }[];
  warnings: string[];
}

const SIGNS: Record<string, string> = { um: "µm", arcsec: "″" };

/** The words of the library with the signs of units: 1 arcsec is 1 ″. */
const withSigns = (words: string): string => words.replace(/(?<=\d )(um|arcsec)\b/g, (unit) => SIGNS[unit] ?? unit);

function combination(of: Record<string, number> | [string, number][]): string {
  const parts = Array.isArray(of) ? of : Object.entries(of);
  return parts.map(([id, factor]) => `${factor >= 0 ? "+" : "−"} ${Math.abs(factor).toPrecision(3)} ${id}`).join(" ");
}

export function Identifiability({ analysis }: { analysis: Analysis }) {
  return (
    <>
      <h2>Identifiability</h2>
      <p>
        Rank {analysis.rank} of {analysis.parameter_count} parameters, {analysis.readings} readings, noise{" "}
        {analysis.noise_um?.toPrecision(3) ?? analysis.noise_arcsec?.toPrecision(3)}{" "}
        {analysis.noise_um === undefined ? "″" : "µm"}
      </p>
      <Scroll label="Uncertainties">
        <table>
          <thead>
            <tr>
              <th>error</th>
              <th>u</th>
              <th>u, others known</th>
              <th>meaning</th>
            </tr>
          </thead>
          <tbody>
            {analysis.errors.map((error) => (
              <tr key={error.id}>
                <td>{error.id}</td>
                <td class="number">
                  {error.u === null
                    ? "not identifiable"
                    : `${error.u.toPrecision(3)} ${SIGNS[error.unit] ?? error.unit}`}
                </td>
                <td class="number">{error.conditional_u?.toPrecision(3) ?? ""}</td>
                <td>{error.meaning}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </Scroll>
      {analysis.unidentifiable.length > 0 && (
        <>
          <h2>Null space: combinations that leave every reading unchanged</h2>
          <ul>
            {analysis.unidentifiable.map((direction, k) => (
              <li key={k}>
                <code>{combination(direction.combination)}</code> {withSigns(direction.why)}
              </li>
            ))}
          </ul>
        </>
      )}
      {analysis.determined_by_prior.length + analysis.nearly_collinear.length > 0 && (
        <>
          <h2>Confounded and poorly separable</h2>
          <ul>
            {analysis.determined_by_prior.map((one) => (
              <li key={one.error}>{withSigns(one.why)}</li>
            ))}
            {analysis.nearly_collinear.map((one, k) => (
              <li key={k}>
                <code>{combination(one.combination)}</code> {withSigns(one.why)}
              </li>
            ))}
          </ul>
        </>
      )}
      {analysis.warnings.length > 0 && (
        <ul class="warning">
          {analysis.warnings.map((warning) => (
            <li key={warning}>{warning}</li>
          ))}
        </ul>
      )}
    </>
  );
}
