// How foreign files were understood: first rows, the meaning of each column, and what is written.

import { Scroll } from "./scroll";

interface Column {
  number: number;
  name: string;
  own?: string;
  direction?: string;
}

interface ImportedTest {
  test: string;
  file: string;
  data: string;
  encoding: string;
  separator: string;
  decimal: string;
  skipped_lines: number;
  rows: number;
  columns: Column[];
  first_rows: string[][];
  normalised: string[];
  remarks: string[];
}

/** The answer of the library. */
export interface Understood {
  result: {
    session: string;
    instrument: string;
    tests: ImportedTest[];
    target_mm?: [number, number, number];
    warnings: string[];
  };
  /** Our columns that such files may have. */
  columns: string[];
  /** The files to write, beside the session. */
  files: [name: string, contents: Uint8Array][];
}

interface Props {
  found: Understood;
  /** Says what a column holds; an empty name takes it back. */
  say: (column: number, own: string) => void;
  use: () => void;
}

const DECIMAL: Record<string, string> = { ".": "point", ",": "comma" };

export function UnderstoodView({ found, say, use }: Props) {
  const { result, columns, files } = found;
  const session = files.find(([name]) => name === result.session)?.[1];
  const notes = result.tests.flatMap(({ normalised, remarks }) => [...normalised, ...remarks]);
  return (
    <>
      {result.tests.map((test) => (
        <TestView key={test.test} test={test} known={columns} isAlone={result.tests.length === 1} say={say} />
      ))}
      {result.target_mm && (
        <p>The target was found at {result.target_mm.map((x) => x.toFixed(1)).join(", ")} mm in the tool frame.</p>
      )}
      {notes.length > 0 && (
        <ul>
          {[...new Set(notes)].map((words) => (
            <li key={words}>{words}</li>
          ))}
        </ul>
      )}
      {result.warnings.map((words) => (
        <p key={words} class="warning">
          {words}
        </p>
      ))}
      <p class="actions">
        <button class="main" onClick={use}>
          Open in Analyse
        </button>
        <span class="note">
          {result.instrument}; writes {files.map(([name]) => name).join(", ")}
        </span>
      </p>
      <details>
        <summary>{result.session}</summary>
        <Scroll label={`Text of ${result.session}`}>
          <pre>{new TextDecoder().decode(session)}</pre>
        </Scroll>
      </details>
    </>
  );
}

interface TestProps {
  test: ImportedTest;
  known: string[];
  /** Whether it is the only test: what is said of a column counts for all files. */
  isAlone: boolean;
  say: (column: number, own: string) => void;
}

function TestView({ test, known, isAlone, say }: TestProps) {
  const width = Math.max(test.columns.length, ...test.first_rows.map((row) => row.length));
  const all = Array.from({ length: width }, (_, k) => test.columns.find(({ number }) => number === k + 1));
  return (
    <>
      <h2>
        {test.file}: test {test.test}
      </h2>
      <p class="note">
        {test.rows} readings; {test.encoding}, {test.separator}, decimal {DECIMAL[test.decimal] ?? test.decimal},{" "}
        {test.skipped_lines === 1 ? "1 line" : `${test.skipped_lines} lines`} above
      </p>
      <Scroll label={`First rows of ${test.file}`}>
        <table>
          <thead>
            <tr>
              {all.map((column, k) => (
                <th key={k} scope="col">
                  {isAlone ? (
                    <select
                      aria-label={`Column ${k + 1}`}
                      value={column?.own ?? ""}
                      onChange={(event) => say(k + 1, event.currentTarget.value)}
                    >
                      <option value="">{column?.own ? "as the file says" : "not used"}</option>
                      {[...new Set([...(column?.own ? [column.own] : []), ...known])].map((name) => (
                        <option key={name}>{name}</option>
                      ))}
                    </select>
                  ) : (
                    (column?.own ?? "not used")
                  )}
                </th>
              ))}
            </tr>
            <tr class="names">
              {all.map((column, k) => (
                <td key={k}>
                  {column?.name || `column ${k + 1}`}
                  {column?.direction && `, ${column.direction}`}
                </td>
              ))}
            </tr>
          </thead>
          <tbody>
            {test.first_rows.map((row, k) => (
              <tr key={k}>
                {all.map((_, column) => (
                  <td key={column}>{row[column] ?? ""}</td>
                ))}
              </tr>
            ))}
          </tbody>
        </table>
      </Scroll>
    </>
  );
}
