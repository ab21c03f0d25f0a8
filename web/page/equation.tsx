// Equations in LaTeX, set as MathML: it needs no fonts, and screen readers read it.

import katex from "katex";
import type { Fault } from "./protocol";
import { Scroll } from "./scroll";

/** The displayed equations of a LaTeX text, with the sentences above them. */
function parts(latex: string): { words: string; equation: string }[] {
  const own = latex.replace(/^%.*$/gm, "").replace(/\\(begingroup|endgroup|allowdisplaybreaks)/g, "");
  const found = [...own.matchAll(/([^\n]*)\n(\\begin\{align\*?\}[\s\S]*?\\end\{align\*?\})/g)];
  return found.map(([, words, equation]) => ({ words, equation }));
}

export function Equation({ latex }: { latex: string | Fault }) {
  if (typeof latex !== "string") return <p class="note">{latex.message}</p>;
  return (
    <>
      {parts(latex).map(({ words, equation }) => {
        const html = katex.renderToString(equation, {
          displayMode: true,
          output: "mathml",
          throwOnError: false,
          trust: false,
        });
        return (
          <div class="equation" key={equation} role="group" aria-label="Equation" tabIndex={0}>
            <p class="note">{words}</p>
            <div dangerouslySetInnerHTML={{ __html: html }} />
          </div>
        );
      })}
      {latex && (
        <details>
          <summary>LaTeX</summary>
          <Scroll label="LaTeX">
            <pre>{latex}</pre>
          </Scroll>
        </details>
      )}
    </>
  );
}
