// The order of search results: a sum over the words of the query, where rare words count more, times the weight of the
// page. SEARCH (pages, kinds, words, entries) is written before this by builder/search.py from its tables.
"use strict";
(() => {
  const FACTORS = { words: 5, title: 4, name: 4, section: 3 }; // of a phrase with all words; a word in a text counts 1
  const LEAST = 0.5; // the share of the query that a result has at least, by the rarity of its words
  const UNKNOWN = 1.5; // the rarity of a word that no text has, as "not"
  const NUMBER = 0.5; // that of a number: the index has none
  const stemmer = new Stemmer();
  const wordsOf = (text) =>
    splitQuery(text.toLowerCase().replace(/n['’]t\b|\bno\b|\bcannot\b/g, " not"))
      .filter((word) => word === "not" || !stopwords.has(word));
  const stems = (text) => wordsOf(text).map((word) => stemmer.stemWord(word));
  const partsOf = (text) => [...new Set(stems(text.replaceAll("_", " ")))];
  const filesOf = (table, word) => (Object.hasOwn(table, word) ? [table[word]].flat() : []);
  const begins = (words, word) => word.length > 2 && words.some((other) => other.startsWith(word));

  // A word of the query: its stem, its parts, where texts have it, and how rare that is.
  const term = (word) => {
    const { terms, titleterms, docnames } = Search._index;
    const stem = stemmer.stemWord(word);
    const where = (words) => new Set(words.flatMap((one) => [...filesOf(terms, one), ...filesOf(titleterms, one)]));
    let [files, share] = [where([stem]), 1];
    if (!files.size && stem.length > 2) {
      const near = [terms, titleterms].flatMap((table) => Object.keys(table).filter((one) => one.startsWith(stem)));
      [files, share] = [where(near), 0.5];
    }
    const seen = files.size ? Math.log(1 + docnames.length / files.size) : UNKNOWN;
    return { stem, parts: partsOf(word), files, share, rarity: /^\d+$/.test(word) ? NUMBER : seen };
  };
  // The share of a word of the query that a list of words has.
  const has = (words, { stem, parts }) => {
    if (words.includes(stem) || parts.every((part) => words.includes(part))) return 1;
    return begins(words, stem) ? 0.5 : 0;
  };
  const sum = (numbers) => numbers.reduce((a, b) => a + b, 0);

  // What the best of some phrases, and a text, add for the words of a query.
  const scored = (query, phrases, inText, weight) => {
    let [best, chosen] = [0, null];
    for (const phrase of phrases) {
      const found = query.map((one) => has(phrase.stems, one));
      const fit = 0.4 + (0.6 * sum(found)) / Math.max(phrase.stems.length, 1);
      const score = FACTORS[phrase.kind] * fit * sum(query.map((one, i) => one.rarity * found[i]));
      if (score > best) [best, chosen] = [score, phrase];
    }
    const seen = query.map((one) => Math.max(inText(one), ...phrases.map((phrase) => has(phrase.stems, one))));
    const covered = sum(query.map((one, i) => one.rarity * seen[i])) / sum(query.map((one) => one.rarity));
    const text = sum(query.map((one) => one.rarity * inText(one)));
    return { score: covered < LEAST ? 0 : weight * covered * (best + text), chosen };
  };

  const weightOf = (name) => {
    const known = Object.keys(SEARCH.pages).filter((start) => name.startsWith(start));
    return SEARCH.pages[known.reduce((a, b) => (a.length > b.length ? a : b))];
  };

  const pagesOf = (query, typed) => {
    const { docnames, filenames, titles, alltitles } = Search._index;
    const phrases = docnames.map((name, file) => [{ kind: "title", stems: stems(titles[file]), anchor: "" }]);
    for (const [title, places] of Object.entries(alltitles))
      for (const [file, anchor] of places)
        if (anchor) phrases[file].push({ kind: "section", stems: stems(title), title, anchor: `#${anchor}` });
    for (const [place, words] of Object.entries(SEARCH.words)) {
      const [name, anchor] = place.split("#");
      const file = docnames.indexOf(name);
      const title = Object.keys(alltitles).find((one) => alltitles[one].some((at) => at[0] === file && at[1] === anchor));
      if (file >= 0 && (title || !anchor))
        for (const phrase of words)
          phrases[file].push({ kind: "words", stems: partsOf(phrase), title, anchor: anchor ? `#${anchor}` : "" });
    }
    return docnames.map((name, file) => {
      const inText = (one) => (one.files.has(file) ? one.share : 0);
      const { score, chosen } = scored(query, phrases[file], inText, weightOf(name));
      const section = chosen?.title?.replace(/\\le\b/g, "<=").replace(/\\ge\b/g, ">=").replace(/\\([A-Za-z]+)/g, "$1");
      const title = section ? `${titles[file]} > ${section}` : titles[file];
      const exact = (SEARCH.words[name] ?? []).some((phrase) => phrase.toLowerCase() === typed) ? 2 : 1;
      return [name, title, chosen?.anchor ?? "", excerptOf(name), exact * score, filenames[file], SearchResultKind.text];
    });
  };

  const entriesOf = (query, typed) =>
    SEARCH.entries.map(([name, place, meaning, kind]) => {
      const last = name.replace(/^ndtheory |^.*\./, "");
      const phrases = [name, last].map((text) => ({ kind: "name", stems: partsOf(text) }));
      for (const phrase of SEARCH.words[place] ?? []) phrases.push({ kind: "words", stems: partsOf(phrase) });
      const said = stems(meaning);
      const { score } = scored(query, phrases, (one) => has(said, one), SEARCH.kinds[kind]);
      const exact = [name, last].some((one) => typed.includes(one.toLowerCase())) ? 2 : 1;
      const [page, anchor] = place.split("#");
      return [page, name, `#${anchor}`, `${kind}: ${meaning}`, exact * score, page, SearchResultKind.object];
    });

  // From disk a browser fetches no page: the beginning of the page is shown in place of a summary.
  const onDisk = location.protocol === "file:";
  if (onDisk) DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false;
  const excerptOf = (name) => (onDisk && SEARCH.excerpts[name]) || null;

  Search._performSearch = (text, _terms, _excluded, _highlighted, objectTerms) => {
    _removeChildren(document.getElementById("search-progress"));
    const query = [...new Set(wordsOf(text))].map(term);
    const typed = text.toLowerCase().trim();
    const entries = entriesOf(query, [typed, ...typed.split(/\s+/)]).filter((entry) => entry[4] > 0);
    const places = new Set(entries.map((entry) => entry[0] + entry[2]));
    const others = pagesOf(query, typed);
    for (const word of objectTerms)
      for (const object of Search.performObjectSearch(word, objectTerms))
        others.push([...object.slice(0, 4), object[4] / 100, ...object.slice(5)]); // after all others
    return [...entries, ...others.filter((one) => one[4] > 0 && !places.has(one[0] + one[2]))].sort(
      _orderResultsByScoreThenName,
    );
  };
})();
