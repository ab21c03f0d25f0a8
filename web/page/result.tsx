// A result: its files and its report.

import { download } from "./files";

export interface Result {
  kind: "fit" | "trace";
  json: string;
  report: string;
  csv: string;
  residuals: string;
  model: string;
  session?: string;
  seconds: number;
  bytes: number;
  processors: number;
}

interface Props {
  result: Result;
  /** The name of the session, for the names of files. */
  stem: string;
}

export function ResultView({ result, stem }: Props) {
  const { kind, seconds, bytes, processors, session } = result;
  return (
    <>
      <p class="actions" data-kind={kind} data-seconds={seconds} data-bytes={bytes} data-processors={processors}>
        <button onClick={() => download(`${stem}-${kind}.json`, result.json, "application/json")}>JSON</button>
        <button onClick={() => download(`${stem}-${kind}.csv`, result.csv)}>CSV</button>
        <button onClick={() => download(`${stem}-residuals.csv`, result.residuals)}>Residuals</button>
        <button onClick={() => download(`${stem}-${kind}.html`, result.report, "text/html")}>Report</button>
        <button onClick={() => download(`${stem}-model.json`, result.model)}>Model</button>
        {session !== undefined && (
          <button onClick={() => download(`${stem}-next.toml`, session)}>Continued session</button>
        )}
        <span>
          {kind} in {seconds.toFixed(1)} s, {processors === 1 ? "one processor" : `${processors} processors`},{" "}
          {(bytes / 2 ** 20).toFixed(0)} MiB
        </span>
      </p>
      <iframe title="Report" sandbox="allow-scripts allow-downloads" srcdoc={result.report} />
    </>
  );
}
