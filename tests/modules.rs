//! The modules of a crate do not import each other in a circle, so that each can be read after those it builds on.
//!
//! A module is a file here, and what stands below it are others. It may use what the modules around it have, which does not
//! count. A name that another module or the crate re-exports counts as one of the module that it comes from. Tests do not count.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// A module or a name: its path from the root of the crate.
type Name = Vec<String>;

/// The text of each module, without comments, literals and tests.
type Sources = BTreeMap<Name, String>;

/// What names in each module stand for, if that is something of the crate.
type Bindings = BTreeMap<Name, BTreeMap<String, Name>>;

/// Paths as they stand in `use`, and the names by which they are known.
type Leaves = Vec<(String, String)>;

/// Which modules each module uses.
type Arrows = BTreeMap<String, BTreeSet<String>>;

/// Paths of a `use` have at most so many re-exports one after the other.
const MAX_REEXPORTS: usize = 8;

fn name(path: &str) -> Name {
    path.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect()
}

/// The text without comments, and with empty literals.
fn code_of(text: &str) -> String {
    let (mut code, mut rest) = (String::new(), text);
    while let Some(first) = rest.chars().next() {
        let is_word = code.ends_with(|last: char| last.is_alphanumeric() || last == '_');
        let hashes = rest.strip_prefix('r').map(|raw| raw.len() - raw.trim_start_matches('#').len());
        let raw = hashes.filter(|&hashes| !is_word && rest[1 + hashes..].starts_with('"'));
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if let Some(hashes) = raw {
            let end = format!("\"{}", "#".repeat(hashes));
            let start = 2 + hashes;
            rest[start..].find(&end).map_or(rest.len(), |at| start + at + end.len())
        } else if first == '"' {
            literal(rest, '"')
        } else if first == '\'' && (rest[1..].starts_with('\\') || rest.chars().nth(2) == Some('\'')) {
            literal(rest, '\'')
        } else {
            code.push(first);
            first.len_utf8()
        };
        rest = &rest[length..];
    }
    code
}

/// Bytes of a literal with its quotes.
fn literal(text: &str, quote: char) -> usize {
    let mut is_escaped = false;
    let end = text.char_indices().skip(1).find(|&(_, character)| {
        let is_end = character == quote && !is_escaped;
        is_escaped = character == '\\' && !is_escaped;
        is_end
    });
    end.map_or(text.len(), |(at, _)| at + quote.len_utf8())
}

/// Bytes of the item that a text starts with, after its attributes: up to its semicolon or the end of its braces.
fn item_length(text: &str) -> usize {
    let mut depth = 0_usize;
    for (at, character) in text.char_indices() {
        match character {
            '{' | '[' | '(' => depth += 1,
            '}' | ']' | ')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth == 0 && matches!(character, ';' | '}') {
            return at + 1;
        }
    }
    text.len()
}

/// The code without items that are compiled for tests alone; and the modules in files of their own among these.
fn without_tests(code: &str) -> (String, Vec<String>) {
    const MARK: &str = "#[cfg(test)]";
    let (mut kept, mut modules, mut rest) = (String::new(), Vec::new(), code);
    while let Some(at) = rest.find(MARK) {
        let (before, item) = rest.split_at(at);
        kept.push_str(before);
        let (item, after) = item.split_at(item_length(item));
        let module = item.strip_suffix(';').and_then(|item| item.rsplit_once("mod "));
        modules.extend(module.map(|(_, name)| name.trim().to_owned()));
        rest = after;
    }
    kept.push_str(rest);
    (kept, modules)
}

/// The modules of a crate below a module, which stands in `file`; its submodules stand in `folder`.
fn collect(module: &Name, file: &Path, folder: &Path, sources: &mut Sources) {
    let (code, of_tests) = without_tests(&code_of(&fs::read_to_string(file).unwrap()));
    for declared in code.split([';', '}', '{', ']']).filter_map(|item| item.rsplit_once("mod ")) {
        let child = declared.1.trim();
        let [plain, nested] =
            [format!("{child}.rs"), format!("{child}/mod.rs")].map(|file| folder.join(file));
        if let Some(file) =
            [plain, nested].iter().find(|file| file.is_file() && !of_tests.contains(&child.to_owned()))
        {
            collect(&[module.clone(), vec![child.to_owned()]].concat(), file, &folder.join(child), sources);
        }
    }
    sources.insert(module.clone(), code);
}

/// The paths of a tree as it stands in a `use`, and the names by which they are known.
fn leaves(tree: &str, before: &str, found: &mut Leaves) {
    let tree = tree.trim();
    if let Some((prefix, group)) = tree.split_once('{') {
        let (mut depth, mut start) = (0_usize, 0);
        let group = group.trim_end().strip_suffix('}').unwrap();
        for (at, character) in group.char_indices().chain([(group.len(), ',')]) {
            match character {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    leaves(&group[start..at], &format!("{before}{prefix}"), found);
                    start = at + 1;
                }
                _ => {}
            }
        }
    } else if !tree.is_empty() {
        let (path, alias) = tree.split_once(" as ").unwrap_or((tree, ""));
        let whole = format!("{before}{}", path.trim());
        let path = whole.strip_suffix("::self").unwrap_or(&whole);
        let known = if alias.is_empty() { path.rsplit("::").next().unwrap() } else { alias.trim() };
        found.push((path.to_owned(), known.to_owned()));
    }
}

/// The trees of all `use` of a module, and the code without them.
fn uses(code: &str) -> (Leaves, String) {
    let (mut found, mut others, mut rest) = (Vec::new(), String::new(), code);
    while let Some(at) = rest.find("use ") {
        let is_word = rest[..at].ends_with(|last: char| last.is_alphanumeric() || last == '_');
        let (before, after) = rest.split_at(at);
        others.push_str(before);
        let end = if is_word { "use ".len() } else { after.find(';').unwrap() };
        if !is_word {
            leaves(&after["use ".len()..end], "", &mut found);
        }
        rest = &after[end..];
    }
    others.push_str(rest);
    (found, others)
}

/// The paths in code that begin at the crate, the module or its parent.
fn paths(code: &str) -> impl Iterator<Item = &str> {
    let words = code.split(|character: char| !character.is_alphanumeric() && !"_:$".contains(character));
    words.filter(|word| ["crate::", "self::", "super::"].iter().any(|start| word.starts_with(start)))
}

/// A path in a module, from the root of the crate; none of another crate.
fn absolute(path: &str, module: &Name, sources: &Sources) -> Option<Name> {
    let mut parts = name(path);
    let mut base = module.clone();
    match parts.first()?.as_str() {
        "crate" => base.clear(),
        "self" | "super" => {}
        first => {
            base.push(first.to_owned());
            let is_own = sources.contains_key(&base);
            return is_own.then(|| [module.clone(), parts].concat());
        }
    }
    let leading = parts.iter().take_while(|part| ["crate", "self", "super"].contains(&part.as_str())).count();
    for part in parts.drain(..leading) {
        if part == "super" {
            base.pop();
        }
    }
    Some([base, parts].concat())
}

/// The module that a name comes from.
fn home(path: &Name, sources: &Sources, bindings: &Bindings, reexports: usize) -> Name {
    let mut module = Name::new();
    for (at, part) in path.iter().enumerate() {
        let inner = [module.clone(), vec![part.clone()]].concat();
        if sources.contains_key(&inner) {
            module = inner;
            continue;
        }
        let bound = bindings.get(&module).and_then(|names| names.get(part));
        return match bound.filter(|_| reexports < MAX_REEXPORTS) {
            Some(bound) => {
                home(&[bound.clone(), path[at + 1..].to_vec()].concat(), sources, bindings, reexports + 1)
            }
            None => module,
        };
    }
    module
}

/// Which modules use which, but for those around them.
fn arrows(sources: &Sources) -> Arrows {
    let used: BTreeMap<&Name, _> = sources.iter().map(|(module, code)| (module, uses(code))).collect();
    let bound = |module: &Name, leaves: &Leaves| -> BTreeMap<String, Name> {
        let known = leaves.iter().filter_map(|(path, known)| Some((known, absolute(path, module, sources)?)));
        known.map(|(known, path)| (known.clone(), path)).collect()
    };
    let bindings: Bindings =
        used.iter().map(|(module, (leaves, _))| ((*module).clone(), bound(module, leaves))).collect();
    let of_module = |(module, (leaves, others)): (&&Name, &(Leaves, String))| {
        let named = leaves.iter().map(|(path, _)| path.as_str()).chain(paths(others));
        let targets = named.filter_map(|path| absolute(path, module, sources));
        let targets = targets.map(|path| home(&path, sources, &bindings, 0));
        let targets = targets.filter(|target| !module.starts_with(target)).map(|target| target.join("::"));
        (module.join("::"), targets.collect())
    };
    used.iter().map(of_module).collect()
}

/// A circle from a module on, if there is one: `path` has led there, and from what is `done` none begins.
fn circle_from<'a>(
    from: &'a str,
    arrows: &'a Arrows,
    path: &mut Vec<&'a str>,
    done: &mut BTreeSet<&'a str>,
) -> Option<String> {
    if let Some(start) = path.iter().position(|&module| module == from) {
        return Some([&path[start..], &[from]].concat().join(" -> "));
    }
    if !done.insert(from) {
        return None;
    }
    path.push(from);
    let found = arrows.get(from).into_iter().flatten().find_map(|to| circle_from(to, arrows, path, done));
    path.pop();
    found
}

/// A circle of arrows, if there is one.
fn circle_of(arrows: &Arrows) -> Option<String> {
    let (mut path, mut done) = (Vec::new(), BTreeSet::new());
    arrows.keys().find_map(|from| circle_from(from, arrows, &mut path, &mut done))
}

/// A circle of modules, if there is one.
fn circle(sources: &Sources) -> Option<String> {
    circle_of(&arrows(sources))
}

/// A circle of modules that stand side by side, each with all that stands below it, if there is one.
fn circle_of_folders(sources: &Sources) -> Option<String> {
    let mut side_by_side = BTreeMap::<Name, Arrows>::new();
    for (from, targets) in arrows(sources) {
        let from = name(&from);
        for to in targets.iter().map(|target| name(target)) {
            let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
            if let (Some(first), Some(second)) = (from.get(common), to.get(common)) {
                let siblings = side_by_side.entry(from[..common].to_vec()).or_default();
                siblings.entry(first.clone()).or_default().insert(second.clone());
            }
        }
    }
    side_by_side.values().find_map(circle_of)
}

/// The modules of each crate that has some, by its folder.
fn crates() -> Vec<(String, Sources)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let manifest = fs::read_to_string(root.join("Cargo.toml")).unwrap();
    let list = manifest.lines().find(|line| line.starts_with("members = ")).unwrap();
    let sources = |member: &str| {
        let src = root.join(member).join("src");
        // A crate of tests alone has neither.
        let file = [src.join("lib.rs"), src.join("main.rs")].into_iter().find(|file| file.is_file())?;
        let mut sources = Sources::new();
        collect(&Name::new(), &file, &src, &mut sources);
        Some((member.to_owned(), sources))
    };
    list.split('"').skip(1).step_by(2).chain([""]).filter_map(sources).collect()
}

/// The modules of a crate whose texts are given by their paths.
fn planted(texts: &[(&str, &str)]) -> Sources {
    texts.iter().map(|(path, text)| (name(path), without_tests(&code_of(text)).0)).collect()
}

#[test]
fn no_crate_has_modules_that_import_in_a_circle() {
    let (mut modules, mut uses) = (0, 0);
    for (folder, sources) in crates() {
        assert_eq!(circle(&sources), None, "{folder}");
        modules += sources.len();
        uses += arrows(&sources).values().map(BTreeSet::len).sum::<usize>();
    }
    // Nothing is overlooked: there are about as many files, and a few arrows for each.
    assert!(modules > 400 && uses > 2 * modules, "{modules} modules, {uses} uses");
}

/// Crates in which a module uses parts of another one that uses it for other parts. No more shall become like them.
const ENTANGLED: [&str; 4] = ["format", "encoder", "stream", "cli"];

#[test]
fn whole_modules_import_in_a_circle_in_no_further_crate() {
    let found: Vec<String> = crates()
        .into_iter()
        .filter(|(_, sources)| circle_of_folders(sources).is_some())
        .map(|(folder, _)| folder)
        .collect();
    assert_eq!(found, ENTANGLED);
}

#[test]
fn a_circle_is_found_where_it_is_planted() {
    let found = |texts: &[(&str, &str)]| circle(&planted(texts)).unwrap();
    let top = [
        ("", "mod a; mod b; mod c;"),
        ("a", "use crate::b::{self, B};"),
        ("b", "use crate::{c::{deep::C as D}}; pub struct B;"),
        ("c", "pub fn d() { crate::a::e(); }"),
    ];
    assert_eq!(found(&top), "a -> b -> c -> a");
    let siblings = [
        ("", "mod a; mod z;"),
        ("a", "mod b; mod c;"),
        ("a::b", "use super::c::C;"),
        ("a::c", "fn f(b: &super::b::B) {}"),
        ("z", "use crate::a::C;"),
    ];
    assert_eq!(found(&siblings), "a::b -> a::c -> a::b");
    let reexported = [
        ("", "mod a; mod b; pub use a::A; pub use b::{B as C};"),
        ("a", "use crate::C;"),
        ("b", "use super::A;"),
    ];
    assert_eq!(found(&reexported), "a -> b -> a");
    let nested = [
        ("", "mod a; mod b;"),
        ("a", "mod inner; use inner::I; pub struct A;"),
        ("a::inner", "use crate::b::B;"),
        ("b", "use crate::a::A;"),
    ];
    assert_eq!(found(&nested), "a -> a::inner -> b -> a");
    let apart = planted(&[
        ("", "mod a; mod b;"),
        ("a", "mod inner; pub struct A;"),
        ("a::inner", "use crate::b::B;"),
        ("b", "use crate::a::A; pub struct B;"),
    ]);
    assert_eq!((circle(&apart), circle_of_folders(&apart)), (None, Some("a -> b -> a".to_owned())));
}

#[test]
fn what_is_no_circle_is_none() {
    let sources = planted(&[
        ("", "mod a; mod b; pub use b::B; pub use std::fmt;"),
        ("a", "mod inner; use inner::I; use crate::B; pub const A: u8 = 1;"),
        ("a::inner", "use super::A; use std::b::X; impl Iterator + use<'a>"),
        (
            "b",
            "//! See [`crate::a`].
             /* use crate::a::A; */ const Q: [char; 2] = ['\"', '\\'']; const S: &str = r#\"use crate::a::A;\"#;
             #[cfg(test)]
             mod tests { use crate::a::A; fn f() { A; } }
             pub struct B;",
        ),
    ]);
    assert_eq!((circle(&sources), circle_of_folders(&sources)), (None, None));
    let used = BTreeSet::from(["a::inner".to_owned(), "b".to_owned()]);
    assert_eq!(arrows(&sources)["a"], used, "b by the name that the crate re-exports");
}
