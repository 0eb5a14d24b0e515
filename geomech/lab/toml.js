// A reader of TOML 1.0: takes and refuses the texts that Python's tomllib takes and refuses, in one pass.

const DEEPEST = 100;  // lists and tables within each other
const ESCAPES = { b: "\b", t: "\t", n: "\n", f: "\f", r: "\r", '"': '"', "\\": "\\" };
const DATE = /\d{4}-\d\d-\d\d(?:[Tt ]\d\d:\d\d:\d\d(?:\.\d+)?(?:[Zz]|[+-]\d\d:\d\d)?)?|\d\d:\d\d:\d\d(?:\.\d+)?/y;
const OTHER_BASE = /0(?:x[\da-fA-F](?:_?[\da-fA-F])*|o[0-7](?:_?[0-7])*|b[01](?:_?[01])*)/y;
const NUMBER = /[+-]?(?:inf|nan|(?:0|[1-9](?:_?\d)*)(?:\.\d(?:_?\d)*)?(?:[eE][+-]?\d(?:_?\d)*)?)/y;
const BARE = /[A-Za-z0-9_-]+/y;

/** A date or a time: no key of a loop takes one. */
class Moment {}

class TomlReader {
  constructor(text) {
    this.text = text.replace(/^\uFEFF/, "").replace(/\r\n/g, "\n");
    this.at = 0;
    this.origins = new Map();  // of tables: "parents" of a header, "header", "dotted" keys, or "inline"
    this.lists = new Set();  // of tables, [[NAME]]
    this.root = this.table("header");
  }

  table(origin) {
    const made = Object.create(null);
    this.origins.set(made, origin);
    return made;
  }

  fail(reason) {
    const line = this.text.slice(0, this.at).split("\n").length;
    throw new Error(`it is not TOML: ${reason} in line ${line}`);
  }

  is(text) { return this.text.startsWith(text, this.at); }

  expect(text) {
    if (!this.is(text)) this.fail(`${JSON.stringify(text)} is missing`);
    this.at += text.length;
  }

  /** Return the text that a sticky pattern matches here, and go past it; null without a match. */
  match(pattern) {
    pattern.lastIndex = this.at;
    const found = pattern.exec(this.text);
    if (found) this.at = pattern.lastIndex;
    return found && found[0];
  }

  blanks() { while (this.is(" ") || this.is("\t")) this.at++; }

  comment() {
    if (!this.is("#")) return;
    for (this.at++; this.at < this.text.length && !this.is("\n"); this.at++) this.letter();
  }

  /** Go past blanks, comments and ends of lines. */
  space() {
    for (;;) {
      this.blanks();
      this.comment();
      if (!this.is("\n")) return;
      this.at++;
    }
  }

  endOfLine() {
    this.blanks();
    this.comment();
    if (this.at < this.text.length) this.expect("\n");
  }

  /** Return the character here, which must not be one of control. */
  letter() {
    const code = this.text.charCodeAt(this.at);
    if ((code < 32 && code !== 9) || code === 127 || Number.isNaN(code)) this.fail("a character may not stand");
    return this.text[this.at];
  }

  read() {
    let here = this.root;
    for (;;) {
      this.space();
      if (this.at >= this.text.length) return this.root;
      if (this.is("[")) here = this.header();
      else this.pair(here);
      this.endOfLine();
    }
  }

  header() {
    const isList = this.is("[["), end = isList ? "]]" : "]";
    this.at += end.length;
    const names = this.names(), last = names.pop();
    let owner = this.root;
    for (const name of names) owner = this.within(owner, name);
    this.expect(end);
    const known = owner[last];
    if (isList) {
      if (known === undefined) this.lists.add(owner[last] = []);
      else if (!this.lists.has(known)) this.fail(`${last} is no list of tables`);
      owner[last].push(this.table("header"));
      return owner[last][owner[last].length - 1];
    }
    if (known === undefined) owner[last] = this.table("header");
    else if (this.origins.get(known) === "parents") this.origins.set(known, "header");
    else this.fail(`${last} is there twice`);
    return owner[last];
  }

  /** Return the table of a name on the way to that of a header. */
  within(owner, name) {
    if (owner[name] === undefined) owner[name] = this.table("parents");
    const found = this.lists.has(owner[name]) ? owner[name][owner[name].length - 1] : owner[name];
    if (!this.origins.has(found) || this.origins.get(found) === "inline") this.fail(`${name} is no table that can grow`);
    return found;
  }

  pair(owner, depth = 0) {
    const names = this.names(), last = names.pop();
    for (const name of names) {
      if (owner[name] === undefined) owner[name] = this.table("dotted");
      if (this.origins.get(owner[name]) !== "dotted") this.fail(`${name} is there twice`);
      owner = owner[name];
    }
    this.expect("=");
    this.blanks();
    if (owner[last] !== undefined) this.fail(`${last} is there twice`);
    owner[last] = this.value(depth);
  }

  /** Return the names of a key with dots, and go past blanks around it. */
  names() {
    const names = [];
    for (;;) {
      this.blanks();
      const quote = this.text[this.at];
      if (quote === '"' || quote === "'") names.push(this.string(quote));
      else names.push(this.match(BARE) ?? this.fail("a key is missing"));
      this.blanks();
      if (names.length > DEEPEST) this.fail("a key has too many parts");
      if (!this.is(".")) return names;
      this.at++;
    }
  }

  value(depth) {
    if (depth > DEEPEST) this.fail("lists are nested too deeply");
    const first = this.text[this.at];
    if (first === '"' || first === "'") return this.is(first.repeat(3)) ? this.longString(first) : this.string(first);
    if (first === "[") return this.list(depth);
    if (first === "{") return this.inline(depth);
    for (const [word, value] of [["true", true], ["false", false]]) {
      if (this.is(word)) {
        this.at += word.length;
        return value;
      }
    }
    if (this.match(DATE)) return new Moment();
    const other = this.match(OTHER_BASE);
    if (other) return Number(other.replace(/_/g, ""));
    const number = this.match(NUMBER);
    if (number === null) this.fail("a value cannot be read");
    return Number(number.replace(/_/g, "").replace("inf", "Infinity").replace("nan", "NaN"));
  }

  list(depth) {
    const values = [];
    this.at++;
    for (;;) {
      this.space();
      if (!this.is("]")) {
        values.push(this.value(depth + 1));
        this.space();
        if (this.is(",")) {
          this.at++;
          continue;
        }
      }
      this.expect("]");
      return values;
    }
  }

  inline(depth) {
    const made = this.table("dotted");
    this.at++;
    this.blanks();
    if (!this.is("}")) {
      for (;;) {
        this.pair(made, depth + 1);
        this.blanks();
        if (!this.is(",")) break;
        this.at++;
      }
    }
    this.expect("}");
    this.close(made);
    return made;
  }

  /** Let nothing more be added to an inline table, nor to those of its dotted keys. */
  close(made) {
    this.origins.set(made, "inline");
    for (const value of Object.values(made)) if (this.origins.get(value) === "dotted") this.close(value);
  }

  string(quote) {
    const parts = [];
    for (this.at++; !this.is(quote); ) {
      if (quote === '"' && this.is("\\")) parts.push(this.escape());
      else {
        parts.push(this.letter());
        this.at++;
      }
    }
    this.at++;
    return parts.join("");
  }

  longString(quote) {
    const end = quote.repeat(3), parts = [];
    this.at += 3;
    if (this.is("\n")) this.at++;
    for (;;) {
      if (this.is(end)) {
        // one or two quotes may stand before the end
        for (let more = 0; more < 2 && this.text[this.at + 3] === quote; more++, this.at++) parts.push(quote);
        this.at += 3;
        return parts.join("");
      }
      if (quote === '"' && this.is("\\")) {
        const start = this.at++;
        this.blanks();
        if (this.is("\n")) while (" \t\n".includes(this.text[this.at] ?? "x")) this.at++;
        else {
          this.at = start;
          parts.push(this.escape());
        }
      } else {
        parts.push(this.is("\n") ? "\n" : this.letter());
        this.at++;
      }
    }
  }

  escape() {
    const kind = this.text[this.at + 1];
    this.at += 2;
    if (Object.hasOwn(ESCAPES, kind)) return ESCAPES[kind];
    const digits = this.text.slice(this.at, this.at + { u: 4, U: 8 }[kind]), code = parseInt(digits, 16);
    const size = { u: 4, U: 8 }[kind];
    if (!size || digits.length < size || /[^\da-fA-F]/.test(digits) || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000)) {
      this.fail("an escape cannot be read");
    }
    this.at += size;
    return String.fromCodePoint(code);
  }
}

/** Return the tables of a TOML text. An Error says in which line it is none. */
const tablesOf = (text) => new TomlReader(text).read();
