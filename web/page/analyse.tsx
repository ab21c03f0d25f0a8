// Analyse: a session, its text with faults, fit and trace, the report.

import { zipSync } from "fflate";
import { useEffect, useRef, useState } from "preact/hooks";
import { bundled, filesOf } from "./bundled";
import { Drop } from "./drop";
import { Editor } from "./editor";
import { Engine } from "./engine";
import { FaultBox, faultOf } from "./fault";
import { download, type FileMap, sessionsIn, text } from "./files";
import type { Opened } from "./main";
import type { Fault } from "./protocol";

interface Checked {
  machine: string;
  instrument: string;
  tests: { name: string; readings: number }[];
  effects: string[];
  warnings: string[];
}

interface Result {
  kind: "fit" | "trace";
  json: string;
  report: string;
  session?: string;
  seconds: number;
  bytes: number;
}

interface Props {
  opened?: Opened;
  explore: (opened: Opened) => void;
  imports: (opened: Opened) => void;
}

/** Largest text in the editor, bytes. */
const EDITABLE = 1 << 20;

export function Analyse({ opened, explore, imports }: Props) {
  const engine = useRef<Engine | undefined>(undefined);
  engine.current ??= new Engine();
  const [files, setFiles] = useState<FileMap>(new Map());
  const [session, setSession] = useState("");
  const [shown, setShown] = useState("");
  const [checked, setChecked] = useState<Checked>();
  const [fault, setFault] = useState<Fault>();
  const [working, setWorking] = useState("");
  const [result, setResult] = useState<Result>();

  /** Number of the opened folder: an end of what was computed for an earlier one is not told. */
  const opening = useRef(0);
  const open = (next: FileMap, path?: string) => {
    const sessions = sessionsIn(next);
    const first = path ?? sessions[0] ?? "";
    opening.current += 1;
    engine.current?.stop();
    setFiles(next);
    setSession(first);
    setShown(first);
    setResult(undefined);
    setChecked(undefined);
    if (first) void check(next, first);
    else setFault({ message: "no session file among these files: a session is a .toml file with [[test]]" });
  };
  useEffect(() => {
    if (opened) open(opened.files, opened.session);
  }, [opened]);

  const check = async (of: FileMap, path: string) => {
    setFault(undefined);
    try {
      await engine.current?.call("folder", [[...of]]);
      setChecked(await engine.current?.call<Checked>("check", [path]));
    } catch (error) {
      setChecked(undefined);
      failed(error, of);
    }
  };
  const failed = (error: unknown, of: FileMap = files) => {
    const found = faultOf(error);
    setFault(found);
    if (found.file && of.has(found.file) && (of.get(found.file)?.length ?? 0) <= EDITABLE) setShown(found.file);
  };
  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  const edit = (changed: string) => {
    const next = new Map(files).set(shown, new TextEncoder().encode(changed));
    setFiles(next);
    clearTimeout(timer.current);
    timer.current = setTimeout(() => void check(next, session), 400);
  };
  const run = async (kind: "fit" | "trace") => {
    setFault(undefined);
    setResult(undefined);
    setWorking(kind === "fit" ? "fitting" : "reading the session");
    const start = performance.now();
    const of = opening.current;
    try {
      await engine.current?.call("folder", [[...files]]);
      const found = await engine.current?.call<Omit<Result, "kind" | "seconds">>(kind, [session], setWorking);
      if (found) setResult({ ...found, kind, seconds: (performance.now() - start) / 1000 });
    } catch (error) {
      if (of === opening.current) failed(error);
    }
    setWorking("");
  };
  const stem =
    session
      .split("/")
      .pop()
      ?.replace(/\.toml$/, "") || "session";
  const save = async (method: "csv" | "residuals" | "model", name: string) => {
    try {
      download(name, (await engine.current?.call<string>(method)) ?? "");
    } catch (error) {
      failed(error);
    }
  };
  const zip = () => download(`${stem}.zip`, new Uint8Array(zipSync(Object.fromEntries(files))), "application/zip");
  const editable = [...files].filter(([, bytes]) => bytes.length <= EDITABLE).map(([path]) => path);
  return (
    <>
      <Drop
        words="Drop a session here: its folder, a ZIP file of it, or its files (.toml, .csv, .xlsx)."
        folders
        open={open}
        failed={failed}
      />
      <p>
        <label>
          Or open a bundled session{" "}
          <select
            value=""
            onChange={(event) => {
              const path = event.currentTarget.value;
              if (path) open(filesOf(path), path.slice(path.lastIndexOf("/") + 1));
            }}
          >
            <option value="">choose …</option>
            {bundled.map(([path, about]) => (
              <option key={path} value={path}>
                {about}
              </option>
            ))}
          </select>
        </label>
      </p>
      {fault && (
        <FaultBox
          fault={fault}
          go={(at) => at.file && files.has(at.file) && (setShown(at.file), setFault({ ...at }))}
        />
      )}
      {session && (
        <>
          <p>
            <label>
              Session{" "}
              <select
                value={session}
                onChange={(event) => {
                  const path = event.currentTarget.value;
                  setSession(path);
                  setShown(path);
                  void check(files, path);
                }}
              >
                {[...new Set([session, ...sessionsIn(files)])].map((path) => (
                  <option key={path}>{path}</option>
                ))}
              </select>
            </label>
          </p>
          {checked && <Summary checked={checked} />}
          <p class="actions">
            <button class="main" disabled={working !== "" || !checked} onClick={() => void run("fit")}>
              Fit
            </button>
            <button class="main" disabled={working !== "" || !checked} onClick={() => void run("trace")}>
              Trace
            </button>
            <button disabled={working === ""} onClick={() => engine.current?.stop()}>
              Stop
            </button>
            <button disabled={!checked} onClick={() => explore({ files, session })}>
              Explore
            </button>
            <button onClick={() => imports({ files, session })}>Import readings</button>
            <button onClick={zip}>Download the session</button>
            <span role="status">{working}</span>
          </p>
          {result && (
            <>
              <p class="actions" data-kind={result.kind} data-seconds={result.seconds} data-bytes={result.bytes}>
                <button onClick={() => download(`${stem}-${result.kind}.json`, result.json, "application/json")}>
                  JSON
                </button>
                <button onClick={() => void save("csv", `${stem}-${result.kind}.csv`)}>CSV</button>
                <button onClick={() => void save("residuals", `${stem}-residuals.csv`)}>Residuals</button>
                <button onClick={() => download(`${stem}-${result.kind}.html`, result.report, "text/html")}>
                  Report
                </button>
                <button onClick={() => void save("model", `${stem}-model.json`)}>Model</button>
                {result.session !== undefined && (
                  <button onClick={() => download(`${stem}-next.toml`, result.session ?? "")}>Continued session</button>
                )}
                <span>
                  {result.kind} in {result.seconds.toFixed(1)} s, {(result.bytes / 2 ** 20).toFixed(0)} MiB
                </span>
              </p>
              <iframe title="Report" sandbox="allow-scripts allow-downloads" srcdoc={result.report} />
            </>
          )}
          <details open={!result}>
            <summary>Files</summary>
            <p>
              <label>
                File{" "}
                <select value={shown} onChange={(event) => setShown(event.currentTarget.value)}>
                  {editable.map((path) => (
                    <option key={path}>{path}</option>
                  ))}
                </select>
              </label>
            </p>
            {files.has(shown) && (
              <Editor
                name={shown}
                text={text(files, shown)}
                fault={fault?.file === shown ? fault : undefined}
                change={edit}
              />
            )}
          </details>
        </>
      )}
    </>
  );
}

function Summary({ checked }: { checked: Checked }) {
  const readings = checked.tests.reduce((sum, test) => sum + test.readings, 0);
  return (
    <div class="summary">
      <p>
        {checked.machine}, {checked.instrument}: {checked.tests.map((test) => test.name).join(", ")};{" "}
        {readings ? `${readings} readings` : "a plan without readings"}
        {checked.effects.length > 0 && `; declared effects: ${checked.effects.join(", ")}`}
      </p>
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
