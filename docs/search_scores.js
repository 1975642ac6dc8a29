/* How search results are ordered: a page that explains something comes before the API and the sources. */
"use strict";

var Scorer = {
  /* Results of the API keep their order among themselves and follow all pages; source code comes last. */
  score: ([docname, title, anchor, descr, score, filename, kind]) => {
    if (docname.startsWith("_modules/")) return score - 200;
    if (docname.startsWith("generated/api/") || kind === "object") return score - 100;
    if (docname.startsWith("generated/")) return score - 6; // indexes: below pages that match as well
    return score;
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
