//! ECMAScript modules in one script, without a bundler.
//!
//! The modules of the player keep to a form that lines tell: an import is one line at the start of a module and names what
//! it takes; what is exported is declared by a line that starts with `export`, or named by one line with `from`. A test holds
//! them to that. The result is no module, and the address of a module is that of the page.

/// A module of the npm packages.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Module<'a> {
    /// Its path from the root of the packages.
    pub(crate) path: &'a str,
    pub(crate) source: &'a str,
}

/// What the packages call each other.
const DECODER: (&str, &str) = ("@splatstream/decoder", "decoder/index.js");

/// A module and all that it imports as one script: each is a function that is called once, after those that it imports.
pub(crate) fn link(modules: &[Module<'_>], entry: &str) -> String {
    let mut linker = Linker { modules, linked: Vec::new(), script: String::new() };
    linker.add(entry);
    linker.script.replace("import.meta.url", "self.location.href")
}

struct Linker<'a> {
    modules: &'a [Module<'a>],
    /// Paths of modules that are in the script.
    linked: Vec<String>,
    script: String,
}

impl Linker<'_> {
    fn add(&mut self, path: &str) {
        if self.linked.iter().any(|linked| linked == path) {
            return;
        }
        self.linked.push(path.to_owned());
        let found = self.modules.iter().find(|module| module.path == path);
        debug_assert!(found.is_some(), "{path} is not listed");
        let Some(module) = found else { return };
        let mut body = String::new();
        let mut exports: Vec<String> = Vec::new();
        for line in module.source.lines() {
            match Line::of(line) {
                Line::Import { names, from } => {
                    let from = resolved(path, from);
                    self.add(&from);
                    if !names.is_empty() {
                        body +=
                            &format!("const {{ {} }} = {};\n", names.replace(" as ", ": "), variable(&from));
                    }
                }
                Line::ExportFrom { names, from } => {
                    let from = resolved(path, from);
                    self.add(&from);
                    let of = variable(&from);
                    exports
                        .extend(names.split(',').map(str::trim).map(|name| format!("{name}: {of}.{name}")));
                }
                Line::Export { name, declaration } => {
                    exports.push(name.to_owned());
                    body += &format!("{declaration}\n");
                }
                Line::Other if line.starts_with("//") => {}
                Line::Other => body += &format!("{line}\n"),
            }
        }
        let exports = exports.join(", ");
        self.script +=
            &format!("const {} = (() => {{\n{body}return {{ {exports} }};\n}})();\n", variable(path));
    }
}

/// What a line of a module is.
enum Line<'a> {
    Import { names: &'a str, from: &'a str },
    ExportFrom { names: &'a str, from: &'a str },
    Export { name: &'a str, declaration: &'a str },
    Other,
}

impl<'a> Line<'a> {
    fn of(line: &'a str) -> Self {
        if let Some(rest) = line.strip_prefix("import ") {
            let (names, from) = rest.split_once(" from ").unwrap_or(("", rest));
            return Self::Import { names: names_in(names), from: quoted(from) };
        }
        let Some(declaration) = line.strip_prefix("export ") else { return Self::Other };
        if let Some((names, from)) = declaration.split_once(" from ") {
            return Self::ExportFrom { names: names_in(names), from: quoted(from) };
        }
        let words = declaration.split(|character: char| !(character.is_alphanumeric() || character == '_'));
        let keywords = ["const", "class", "function", "async"];
        match words.clone().find(|word| !keywords.contains(word)) {
            Some(name) => Self::Export { name, declaration },
            None => Self::Other,
        }
    }
}

fn names_in(braces: &str) -> &str {
    braces.trim().trim_start_matches('{').trim_end_matches('}').trim()
}

fn quoted(text: &str) -> &str {
    text.trim().trim_end_matches(';').trim_matches('\'')
}

/// The path that a module means by a name.
fn resolved(importer: &str, name: &str) -> String {
    if name == DECODER.0 {
        return DECODER.1.to_owned();
    }
    let folder = importer.rsplit_once('/').map_or("", |(folder, _)| folder);
    match name.strip_prefix("../") {
        Some(beside) => beside.to_owned(),
        None => format!("{folder}/{}", name.trim_start_matches("./")),
    }
}

/// The variable that holds what a module exports.
fn variable(path: &str) -> String {
    path.trim_end_matches(".js").replace(['/', '.', '-'], "_")
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODULES: &[Module<'static>] = &[
        Module {
            path: "a/main.js",
            source: "// Main.\nimport { one, two as second } from './other.js';\nimport '../b/more.js';\nexport const sum = one + second;\n",
        },
        Module {
            path: "a/other.js",
            source: "export const one = 1;\nexport async function two() {\n  return 2;\n}\n",
        },
        Module { path: "b/more.js", source: "export { one } from '../a/other.js';\nexport class More {}\n" },
    ];

    #[test]
    fn modules_come_once_after_those_that_they_import() {
        let script = link(MODULES, "a/main.js");
        assert_eq!(
            script,
            "const a_other = (() => {\nconst one = 1;\nasync function two() {\n  return 2;\n}\nreturn { one, two };\n})();\n\
             const b_more = (() => {\nclass More {}\nreturn { one: a_other.one, More };\n})();\n\
             const a_main = (() => {\nconst { one, two: second } = a_other;\nconst sum = one + second;\nreturn { sum };\n})();\n"
        );
    }

    #[test]
    fn the_modules_of_the_packages_keep_to_the_form() {
        for module in crate::MODULES {
            for line in module.source.lines() {
                let said = match Line::of(line) {
                    Line::Import { from, .. } | Line::ExportFrom { from, .. } => resolved(module.path, from),
                    Line::Export { .. } | Line::Other => continue,
                };
                assert!(crate::MODULES.iter().any(|module| module.path == said), "{}: {line}", module.path);
            }
            assert!(!module.source.contains("\n  import {") && !module.source.contains("export default"));
            assert!(!module.source.contains("</script"), "{}", module.path);
        }
        for entry in ["page/start.js", "decoder/worker.js"] {
            let script = link(crate::MODULES, entry);
            assert!(!script.lines().any(|line| line.starts_with("import ") || line.starts_with("export ")));
            assert!(!script.contains("import.meta"));
        }
    }
}
