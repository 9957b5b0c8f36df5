// SPDX-License-Identifier: MIT OR Apache-2.0
//! Imports between the modules of a crate, read from its sources and checked against its floors.
//!
//! `docs/explanation/architecture.md` lists the top-level modules of each crate, top to bottom, one
//! floor a line. A module imports from lower floors only, and sibling modules below the top level
//! form no cycles. Imports between a module and its own descendants are free. The sources are read
//! as tokens: every `use`, and every path that begins with `crate`, `self`, `super`, a child module
//! or an imported name. Re-exports are followed to the module that defines the item. Items under
//! `#[cfg(test)]` are left out.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{self, Display};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// Segments of a path below the root of the crate.
type ModulePath = Vec<String>;

/// The floors of one crate, top to bottom, each with the modules that stand on it.
pub type Floors = Vec<Vec<String>>;

/// The floors of `krate` in a document: the fenced block that begins with "```floors krate".
pub fn floors(document: &str, krate: &str) -> Option<Floors> {
    let head = format!("```floors {krate}");
    let mut lines = document.lines().skip_while(|line| line.trim() != head);
    lines.next()?;
    let floors = lines
        .take_while(|line| line.trim() != "```")
        .map(|line| line.split_whitespace().map(str::to_owned).collect())
        .filter(|floor: &Vec<String>| !floor.is_empty());
    Some(floors.collect())
}

/// One import that breaks a rule, or a module that the floors do not agree on.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Violation {
    /// File and line of the import; none where the list of floors is at fault.
    pub place: Option<(String, usize)>,
    /// What is wrong: the arrow and the rule that it breaks.
    pub message: String,
}

impl Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Some((file, line)) => write!(f, "{file}:{line}: {}", self.message),
            None => f.write_str(&self.message),
        }
    }
}

/// What one module says.
#[derive(Debug, Default)]
struct Module {
    file: String,
    /// Paths by the name that a `use` binds them to.
    names: BTreeMap<String, Vec<String>>,
    /// Paths whose public items a glob import brings in.
    globs: Vec<Vec<String>>,
    /// Names of the items defined here.
    items: BTreeSet<String>,
    /// Paths mentioned, with the line.
    mentions: Vec<(usize, Vec<String>)>,
}

/// The modules of one crate by their paths; the root has the empty path.
#[derive(Debug, Default)]
pub struct Crate {
    modules: BTreeMap<ModulePath, Module>,
}

/// An import of a module by another, neither of which contains the other.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Import {
    place: (String, usize),
    from: ModulePath,
    to: ModulePath,
}

impl Import {
    /// The siblings that contain the two ends, with their common parent.
    fn siblings(&self) -> (&[String], &str, &str) {
        let ends = self.from.iter().zip(&self.to);
        let depth = ends.take_while(|(from, to)| from == to).count();
        (&self.from[..depth], &self.from[depth], &self.to[depth])
    }

    fn violation(&self, rule: &str) -> Violation {
        Violation {
            place: Some(self.place.clone()),
            message: format!("{} -> {}: {rule}", self.from.join("::"), self.to.join("::")),
        }
    }
}

impl Crate {
    /// The crate whose sources lie in `folder`, from `lib.rs` on. `read` gives the text of a file,
    /// or none where it does not exist.
    ///
    /// # Panics
    /// If a file is missing or is no Rust.
    pub fn read(folder: &str, read: &dyn Fn(&str) -> Option<String>) -> Self {
        let mut this = Self::default();
        let mut open = vec![(Vec::new(), vec![format!("{folder}/lib.rs")])];
        while let Some((path, candidates)) = open.pop() {
            let found = candidates.iter().find_map(|file| Some((file, read(file)?)));
            let (file, text) = found.unwrap_or_else(|| panic!("none of {candidates:?} exists"));
            let tokens: TokenStream = text.parse().unwrap_or_else(|e| panic!("{file}: {e}"));
            let mut children = Vec::new();
            this.scan(file, &path, tokens, &mut children);
            for child in children {
                let stem = format!("{folder}/{}", child.join("/"));
                open.push((child, vec![format!("{stem}.rs"), format!("{stem}/mod.rs")]));
            }
        }
        this
    }

    /// Reads the tokens of module `path` and of its inline modules; the modules in files of their
    /// own come out as `children`.
    fn scan(
        &mut self,
        file: &str,
        path: &[String],
        tokens: TokenStream,
        children: &mut Vec<ModulePath>,
    ) {
        let module = self.modules.entry(path.to_vec()).or_default();
        file.clone_into(&mut module.file);
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        while at < tokens.len() {
            let module = self.modules.entry(path.to_vec()).or_default();
            match &tokens[at] {
                TokenTree::Punct(p) if p.as_char() == '#' && is_test(tokens.get(at + 1)) => {
                    at = end_of_item(&tokens, at + 2);
                    continue;
                }
                TokenTree::Ident(word) if word == "use" => {
                    let end = end_of_statement(&tokens, at);
                    module.import(&tokens[at + 1..end], &[]);
                    at = end;
                }
                TokenTree::Ident(word) if word == "mod" => {
                    let mut child = path.to_vec();
                    child.push(tokens[at + 1].to_string());
                    match tokens.get(at + 2) {
                        Some(TokenTree::Group(body)) => {
                            self.scan(file, &child, body.stream(), children);
                        }
                        _ => children.push(child),
                    }
                    at += 2;
                }
                TokenTree::Ident(word) => {
                    const DEFINING: [&str; 8] =
                        ["struct", "enum", "trait", "fn", "type", "const", "static", "union"];
                    if let (true, Some(TokenTree::Ident(name))) =
                        (DEFINING.contains(&&*word.to_string()), tokens.get(at + 1))
                    {
                        module.items.insert(name.to_string());
                    }
                    let line = word.span().start().line;
                    let (segments, end) = segments(&tokens, at);
                    if segments.len() > 1 {
                        module.mentions.push((line, segments));
                    }
                    at = end;
                    continue;
                }
                TokenTree::Group(group) => self.scan(file, path, group.stream(), children),
                _ => {}
            }
            at += 1;
        }
    }

    /// The path from the root that `segments` mean in module `at`; none for those of other crates.
    fn absolute(&self, at: &[String], segments: &[String]) -> Option<Vec<String>> {
        let module = self.modules.get(at)?;
        let mut base = at.to_vec();
        let mut rest = segments;
        match segments.first()?.as_str() {
            "crate" => {
                base.clear();
                rest = &rest[1..];
            }
            "self" => rest = &rest[1..],
            "super" => {
                while rest.first().is_some_and(|s| s == "super") {
                    base.pop()?;
                    rest = &rest[1..];
                }
            }
            first => {
                let child = [at, &[first.to_owned()]].concat();
                if !self.modules.contains_key(&child) {
                    let bound = module.names.get(first)?;
                    // A name bound to a path that begins with itself is that of another crate.
                    if bound.first().is_some_and(|s| s == first) {
                        return None;
                    }
                    base = self.absolute(at, bound)?;
                    rest = &rest[1..];
                }
            }
        }
        base.extend(rest.iter().cloned());
        Some(base)
    }

    /// The module that defines the item at an absolute path, re-exports followed.
    fn definer(&self, path: &[String]) -> ModulePath {
        let mut path = path.to_vec();
        // More re-exports in a row than any crate has.
        for _ in 0..16 {
            let depth = (0..=path.len()).rev();
            let known = depth.map(|n| &path[..n]).find(|p| self.modules.contains_key(*p));
            let at = known.unwrap_or_default().to_vec();
            let module = &self.modules[&at];
            let Some(name) = path.get(at.len()) else {
                return at;
            };
            if module.items.contains(name) {
                return at;
            }
            let next = match module.names.get(name) {
                Some(bound) => self.absolute(&at, bound),
                None => self.by_glob(&at, name),
            };
            match next {
                Some(mut next) => {
                    next.extend(path.drain(at.len() + 1..));
                    path = next;
                }
                None => return at,
            }
        }
        path
    }

    /// The absolute path of `name` where a glob import of module `at` brings it in.
    fn by_glob(&self, at: &[String], name: &str) -> Option<Vec<String>> {
        let globs = self.modules[at].globs.iter();
        globs.filter_map(|glob| self.absolute(at, glob)).find_map(|mut base| {
            let module = self.modules.get(&base)?;
            let has = module.items.contains(name) || module.names.contains_key(name);
            base.push(name.to_owned());
            has.then_some(base)
        })
    }

    /// Every import between modules neither of which contains the other, once for each pair.
    fn imports(&self) -> Vec<Import> {
        let mut found: Vec<Import> = Vec::new();
        for (from, module) in &self.modules {
            for (line, segments) in &module.mentions {
                let Some(path) = self.absolute(from, segments) else {
                    continue;
                };
                let to = self.definer(&path);
                let related = from.starts_with(&to) || to.starts_with(from);
                let known = found.iter().any(|i| i.from == *from && i.to == to);
                if !related && !known {
                    found.push(Import {
                        place: (module.file.clone(), *line),
                        from: from.clone(),
                        to,
                    });
                }
            }
        }
        found
    }

    /// Everything that breaks the rules, in order of file and line.
    pub fn violations(&self, floors: &Floors) -> Vec<Violation> {
        let mut found = self.unlisted(floors);
        let imports = self.imports();
        let floor = |module: &str| floors.iter().position(|f| f.iter().any(|m| m == module));
        for import in &imports {
            let (parent, from, to) = import.siblings();
            if !parent.is_empty() {
                continue;
            }
            match (floor(from), floor(to)) {
                (Some(a), Some(b)) if a > b => {
                    found.push(import.violation(&format!("upwards, {from} stands below {to}")));
                }
                (Some(a), Some(b)) if a == b => found.push(
                    import.violation(&format!("sideways, {from} and {to} stand on one floor")),
                ),
                _ => {}
            }
        }
        found.extend(in_cycles(&imports));
        found.sort();
        found
    }

    /// Top-level modules that the floors lack, list twice or invent.
    fn unlisted(&self, floors: &Floors) -> Vec<Violation> {
        let top = self.modules.keys().filter(|path| path.len() == 1);
        let there: BTreeSet<&String> = top.map(|path| &path[0]).collect();
        let mut listed = BTreeSet::new();
        let mut messages = Vec::new();
        for module in floors.iter().flatten() {
            if !listed.insert(module) {
                messages.push(format!("{module}: stands on two floors"));
            }
        }
        let absent = listed.difference(&there);
        messages
            .extend(absent.map(|m| format!("{m}: stands on a floor, but there is no such module")));
        let missing = there.difference(&listed);
        messages.extend(missing.map(|m| format!("{m}: stands on no floor")));
        let none = |message| Violation { place: None, message };
        messages.into_iter().map(none).collect()
    }
}

impl Module {
    /// Reads one `use` tree below `prefix`.
    fn import(&mut self, tokens: &[TokenTree], prefix: &[String]) {
        let Some(first) = tokens.iter().find(|t| !matches!(t, TokenTree::Punct(_))) else {
            if tokens.iter().any(is_star) {
                self.globs.push(prefix.to_vec());
            }
            return;
        };
        let line = first.span().start().line;
        let mut path = prefix.to_vec();
        let mut name = None;
        let mut tokens = tokens.iter();
        while let Some(token) = tokens.next() {
            match token {
                TokenTree::Ident(word) if word == "as" => {
                    name = tokens.next().map(TokenTree::to_string);
                }
                TokenTree::Ident(word) => path.push(word.to_string()),
                TokenTree::Group(list) => {
                    let list: Vec<TokenTree> = list.stream().into_iter().collect();
                    for tree in
                        list.split(|t| matches!(t, TokenTree::Punct(p) if p.as_char() == ','))
                    {
                        self.import(tree, &path);
                    }
                    return;
                }
                token if is_star(token) => {
                    self.globs.push(path.clone());
                    self.mentions.push((line, path));
                    return;
                }
                _ => {}
            }
        }
        if path.last().is_some_and(|s| s == "self") && path.len() > 1 {
            path.pop();
        }
        if let Some(last) = path.last() {
            self.names.insert(name.unwrap_or_else(|| last.clone()), path.clone());
            self.mentions.push((line, path));
        }
    }
}

fn is_star(token: &TokenTree) -> bool {
    matches!(token, TokenTree::Punct(p) if p.as_char() == '*')
}

/// The identifiers of the path that begins at `at`, joined by `::`, and where the tokens go on.
fn segments(tokens: &[TokenTree], at: usize) -> (Vec<String>, usize) {
    let colon = |i: usize| matches!(tokens.get(i), Some(TokenTree::Punct(p)) if p.as_char() == ':');
    // What follows `::` belongs to a path that begins elsewhere: `<T as Trait>::name`.
    let inner = at >= 2 && colon(at - 1) && colon(at - 2);
    let mut segments = vec![tokens[at].to_string()];
    let mut end = at + 1;
    while colon(end) && colon(end + 1) {
        let Some(TokenTree::Ident(word)) = tokens.get(end + 2) else {
            break;
        };
        segments.push(word.to_string());
        end += 3;
    }
    if inner {
        segments.clear();
    }
    (segments, end)
}

/// Whether an attribute is `cfg(test)`, or `cfg(all(test, ...))`.
fn is_test(attribute: Option<&TokenTree>) -> bool {
    fn holds(stream: TokenStream) -> bool {
        let tokens: Vec<TokenTree> = stream.into_iter().collect();
        tokens.iter().enumerate().any(|(i, token)| match token {
            TokenTree::Ident(word) => word == "test",
            TokenTree::Group(inner) => {
                let all = matches!(&tokens[..i], [.., TokenTree::Ident(word)] if word == "all");
                all && holds(inner.stream())
            }
            _ => false,
        })
    }
    let Some(TokenTree::Group(attribute)) = attribute else {
        return false;
    };
    let tokens: Vec<TokenTree> = attribute.stream().into_iter().collect();
    match &tokens[..] {
        [TokenTree::Ident(cfg), TokenTree::Group(condition)] => {
            cfg == "cfg" && holds(condition.stream())
        }
        _ => false,
    }
}

/// Where the next `;` stands at or after `at`.
fn end_of_statement(tokens: &[TokenTree], at: usize) -> usize {
    let ends = |t: &TokenTree| matches!(t, TokenTree::Punct(p) if p.as_char() == ';');
    let rest = tokens[at..].iter().position(ends);
    rest.map_or(tokens.len(), |n| at + n)
}

/// The first token after the item whose attributes begin at `at`.
fn end_of_item(tokens: &[TokenTree], at: usize) -> usize {
    let word = |t: &TokenTree| match t {
        TokenTree::Ident(word) => word.to_string(),
        _ => String::new(),
    };
    let end = end_of_statement(tokens, at);
    let braces =
        |t: &TokenTree| matches!(t, TokenTree::Group(g) if g.delimiter() == Delimiter::Brace);
    let body = tokens[at..end].iter().position(braces).map(|n| at + n);
    let head = &tokens[at..body.unwrap_or(end)];
    let first = head.iter().map(word).find(|w| !w.is_empty() && w != "pub");
    let first = first.unwrap_or_default();
    let items = [
        "async",
        "const",
        "enum",
        "extern",
        "fn",
        "impl",
        "let",
        "macro_rules",
        "mod",
        "static",
        "struct",
        "trait",
        "type",
        "union",
        "unsafe",
        "use",
    ];
    if !items.contains(&&*first) {
        // A field or a variant.
        let comma = |t: &TokenTree| matches!(t, TokenTree::Punct(p) if p.as_char() == ',');
        let rest = tokens[at..].iter().position(comma);
        return rest.map_or(tokens.len(), |n| at + n + 1);
    }
    let constant = first == "const" && !head.iter().any(|t| word(t) == "fn");
    let statement = constant || ["use", "static", "let"].contains(&&*first);
    match body {
        Some(body) if !statement => body + 1,
        _ => end + 1,
    }
}

/// Imports that are part of a cycle of sibling modules below the top level. On the top level a
/// cycle has an arrow upwards or sideways.
fn in_cycles(imports: &[Import]) -> Vec<Violation> {
    let mut graphs: BTreeMap<&[String], BTreeMap<&str, BTreeSet<&str>>> = BTreeMap::new();
    for import in imports {
        let (parent, from, to) = import.siblings();
        let graph = graphs.entry(parent).or_default();
        graph.entry(from).or_default().insert(to);
    }
    let mut found = Vec::new();
    for import in imports {
        let (parent, from, to) = import.siblings();
        if parent.is_empty() {
            continue;
        }
        if let Some(way) = way(&graphs[parent], to, from) {
            found.push(import.violation(&format!(
                "a cycle in {}, {from} -> {}",
                parent.join("::"),
                way.join(" -> ")
            )));
        }
    }
    found
}

/// The modules on the shortest way from `from` to `to`, both ends included.
fn way<'a>(
    graph: &BTreeMap<&'a str, BTreeSet<&'a str>>,
    from: &'a str,
    to: &'a str,
) -> Option<Vec<&'a str>> {
    let mut ways = vec![vec![from]];
    let mut seen = BTreeSet::from([from]);
    let mut next = 0;
    while next < ways.len() {
        let way = ways[next].clone();
        let end = way[way.len() - 1];
        if end == to {
            return Some(way);
        }
        for step in graph.get(end).into_iter().flatten() {
            if seen.insert(step) {
                ways.push([&way[..], &[*step]].concat());
            }
        }
        next += 1;
    }
    None
}

#[cfg(test)]
mod tests;
