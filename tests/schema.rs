//! What commands print as JSON is what the schemas in docs/schema say, and no more than that: a key that
//! is there may not have another name or another type, and one that is always there may not be left out.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use cnc::base::Axis;
use cnc::wire_io::journal::{History, Record};
use jsonschema::{Draft, Registry, Validator};
use serde_json::{Map, Value, json};

/// Definitions for the other schemas.
const COMMON: &str = "common";
/// Keys that no command can be made to print here.
const UNSEEN: [(&str, &str); 2] = [
    // Bytes that a port did not take, and a disk that is too slow.
    ("trace", "failed"),
    ("trace", "lost"),
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every schema by its name.
fn documents() -> BTreeMap<String, Value> {
    let folder = fs::read_dir(root().join("docs/schema")).unwrap();
    let files = folder.map(|entry| entry.unwrap().path());
    let schemas = files.filter(|file| file.extension().is_some_and(|ending| ending == "json"));
    schemas.map(|file| (name(&file), parse(&fs::read_to_string(&file).unwrap()))).collect()
}

fn name(file: &Path) -> String {
    let name = file.file_name().unwrap().to_str().unwrap();
    name.strip_suffix(".schema.json").unwrap_or_else(|| panic!("{name}")).to_owned()
}

fn parse(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn uri(name: &str) -> String {
    format!("file:///schema/{name}.schema.json")
}

fn validators(documents: &BTreeMap<String, Value>) -> BTreeMap<String, Validator> {
    let resources = documents.iter().map(|(name, schema)| (uri(name), schema.clone()));
    let registry = Registry::new().draft(Draft::Draft202012).extend(resources).unwrap();
    let registry = registry.prepare().unwrap();
    let build = |name: &str| {
        let options = jsonschema::options().with_draft(Draft::Draft202012).with_registry(&registry);
        let schema = json!({"$ref": uri(name)});
        options.build(&schema).unwrap_or_else(|error| panic!("{name}: {error}"))
    };
    documents.keys().map(|name| (name.clone(), build(name))).collect()
}

/// A folder to run in, with the samples in it and `cnc` on the path.
fn playground() -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    symlink(root().join("samples"), folder.path().join("samples")).unwrap();
    for file in ["ports.json", "table.toml"] {
        symlink(root().join("tests/schema").join(file), folder.path().join(file)).unwrap();
    }
    let program = PathBuf::from(env!("CARGO_BIN_EXE_cnc"));
    let path = std::env::var("PATH").unwrap_or_default();
    (folder, format!("{}:{path}", program.parent().unwrap().display()))
}

/// What every command of the table prints, by schema.
fn printed() -> BTreeMap<String, Vec<Value>> {
    let (folder, path) = playground();
    let mut printed: BTreeMap<String, Vec<Value>> = BTreeMap::new();
    for case in include_str!("schema/cases.txt").lines() {
        if case.is_empty() || case.starts_with('#') {
            continue;
        }
        let mut words = case.splitn(3, ' ');
        let (schema, code) = (words.next().unwrap(), words.next().unwrap());
        let output = Command::new("sh")
            .args(["-c", words.next().unwrap()])
            .current_dir(&folder)
            .env("PATH", &path)
            .env_remove("CNC_MACHINE")
            .env("XDG_STATE_HOME", folder.path())
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), code.parse().ok(), "{case}\n{said}");
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(!text.is_empty(), "{case} printed nothing\n{said}");
        for value in text.lines().map(parse) {
            // Some programs of a loop are refused.
            let name = if value["result"] == "error" { "error" } else { schema };
            printed.entry(name.to_owned()).or_default().push(value);
        }
    }
    printed
}

/// What a change of what was printed came to.
#[derive(Default)]
struct Tried {
    faults: BTreeSet<String>,
    /// Changes that were tried already: the kind of object and the key.
    done: BTreeSet<(String, String)>,
    /// Keys that may be left out of an object of this kind.
    optional: BTreeSet<(String, String)>,
    /// Of each kind of object: how many there were, and how many had each key.
    kinds: BTreeMap<String, (usize, BTreeMap<String, usize>)>,
    keys: BTreeSet<String>,
}

impl Tried {
    fn instance(&mut self, validator: &Validator, instance: &Value) {
        if let Err(error) = validator.validate(instance) {
            let at = error.instance_path().to_string();
            // One is enough to see what is wrong.
            self.faults.retain(|fault| !fault.contains("\nof "));
            self.faults.insert(format!("{at}: {error}\nof {}", short(instance)));
            return;
        }
        self.value(validator, instance, &mut Vec::new(), instance, "");
    }

    /// Tries changes of a value within the instance.
    fn value(
        &mut self,
        validator: &Validator,
        whole: &Value,
        path: &mut Vec<String>,
        value: &Value,
        shape: &str,
    ) {
        let kind = kind(value, shape);
        match value {
            Value::Object(object) => {
                self.count(&kind, object);
                self.change(validator, whole, path, &kind, "a key more", |object| {
                    object.as_object_mut().unwrap().insert("key-more".to_owned(), json!(1));
                });
                let is_map = shape.ends_with("/origins")
                    || object.keys().all(|key| is_name(key)) && !object.is_empty();
                for (key, inner) in object {
                    self.keys.insert(key.clone());
                    self.change(
                        validator,
                        whole,
                        path,
                        &kind,
                        &format!("another name of {key}"),
                        |object| {
                            let object = object.as_object_mut().unwrap();
                            let inner = object.remove(key).unwrap();
                            object.insert(format!("{key}-"), inner);
                        },
                    );
                    if !is_map {
                        self.leave_out(validator, whole, path, &kind, key);
                    }
                    path.push(key.clone());
                    let shape = if is_map { format!("{kind}/*") } else { format!("{kind}/{key}") };
                    self.value(validator, whole, path, inner, &shape);
                    path.pop();
                }
            }
            Value::Array(items) => {
                for (at, item) in items.iter().enumerate() {
                    path.push(at.to_string());
                    self.value(validator, whole, path, item, &format!("{kind}/[]"));
                    path.pop();
                }
            }
            _ => {}
        }
        self.change(validator, whole, path, &kind, "another type", |value| *value = other(value));
    }

    fn count(&mut self, kind: &str, object: &Map<String, Value>) {
        let (seen, keys) = self.kinds.entry(kind.to_owned()).or_default();
        *seen += 1;
        for key in object.keys() {
            *keys.entry(key.clone()).or_default() += 1;
        }
    }

    /// A change that the schema has to refuse.
    fn change(
        &mut self,
        validator: &Validator,
        whole: &Value,
        path: &[String],
        kind: &str,
        what: &str,
        change: impl Fn(&mut Value),
    ) {
        if self.done.insert((kind.to_owned(), what.to_owned())) {
            let changed = changed(whole, path, change);
            if validator.is_valid(&changed) {
                self.faults.insert(format!("{kind}: {what} is not refused"));
            }
        }
    }

    fn leave_out(
        &mut self,
        validator: &Validator,
        whole: &Value,
        path: &[String],
        kind: &str,
        key: &str,
    ) {
        let place = (kind.to_owned(), key.to_owned());
        if self.done.insert((kind.to_owned(), format!("no {key}"))) {
            let changed = changed(whole, path, |object| {
                object.as_object_mut().unwrap().remove(key);
            });
            if validator.is_valid(&changed) {
                self.optional.insert(place);
            }
        }
    }

    /// All that is wrong: a key that was always there has to be required.
    fn faults(mut self) -> BTreeSet<String> {
        for (kind, key) in &self.optional {
            let (seen, keys) = &self.kinds[kind];
            if keys[key] == *seen {
                self.faults.insert(format!("{kind}: {key} is always there, and not required"));
            }
        }
        self.faults
    }
}

fn changed(whole: &Value, path: &[String], change: impl Fn(&mut Value)) -> Value {
    let mut changed = whole.clone();
    let mut value = &mut changed;
    for step in path {
        value = match value {
            Value::Array(items) => &mut items[step.parse::<usize>().unwrap()],
            inner => &mut inner[step],
        };
    }
    change(value);
    changed
}

/// Values at the same place that are told apart by what they are.
fn kind(value: &Value, shape: &str) -> String {
    let told = ["type", "dir", "ok", "method"].into_iter().filter_map(|key| value.get(key));
    let told: Vec<String> = told.map(Value::to_string).collect();
    match value {
        Value::Object(_) => format!("{shape}{{{}}}", told.join(" ")),
        Value::Null => format!("{shape} null"),
        _ => shape.to_owned(),
    }
}

/// A value of a type that is meant nowhere beside this one.
fn other(value: &Value) -> Value {
    match value {
        Value::Null => json!({"key": 1}),
        Value::Bool(_) => json!("yes"),
        Value::Number(_) => json!("text"),
        Value::String(_) => json!(7.5),
        Value::Array(_) => json!({}),
        Value::Object(_) => json!([]),
    }
}

/// An axis, a node's ID, or an event with a hook: names in a map.
fn is_name(key: &str) -> bool {
    let is_axis = key.len() == 1 && Axis::from_letter(key.as_bytes()[0]).is_some();
    let is_number = |text: &str| text.parse::<u32>().is_ok();
    is_axis || is_number(key) || key == "S" || key.strip_prefix('M').is_some_and(is_number)
}

fn short(value: &Value) -> String {
    value.to_string().chars().take(2000).collect()
}

/// Keys that a schema names: those of its own, and of the schemas that it uses as a whole.
fn named(schema: &Value) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    each(schema, &mut |schema| {
        if let Some(Value::Object(properties)) = schema.get("properties") {
            names.extend(properties.keys().cloned());
        }
    });
    names
}

/// Takes every schema within a schema, itself first.
fn each(schema: &Value, take: &mut impl FnMut(&Value)) {
    let Value::Object(object) = schema else { return };
    take(schema);
    for (key, inner) in object {
        match (key.as_str(), inner) {
            ("properties" | "patternProperties" | "$defs", Value::Object(schemas)) => {
                schemas.values().for_each(|schema| each(schema, take));
            }
            ("oneOf" | "anyOf", Value::Array(schemas)) => {
                schemas.iter().for_each(|schema| each(schema, take));
            }
            ("items" | "additionalProperties" | "propertyNames", schema) => each(schema, take),
            _ => {}
        }
    }
}

/// Lines of a journal that take a person or a long job, behind lines of jobs.
fn rare_lines(lines: &[Value]) -> Vec<Value> {
    let mut history = History::default();
    for line in lines.iter().filter(|line| line.get("type").is_some()) {
        history.record(serde_json::from_value(line.clone()).unwrap());
    }
    let placed = |axis: Axis| Record::Placed {
        time: "2026-11-22T10:00:00Z".to_owned(),
        by: "operator".to_owned(),
        machine: "starmill".to_owned(),
        position: [(axis, 7500)].into(),
    };
    let carried = Record::Carried(Box::new(history));
    let records = [
        carried,
        Record::Carried(Box::default()),
        Record::Held { ticks: 7, line: 3, executing: true },
        Record::Resumed,
        Record::PowerCycled { time: "2026-11-22T10:00:00Z".to_owned() },
        placed(Axis::X),
    ];
    records.iter().map(|record| serde_json::to_value(record).unwrap()).collect()
}

#[test]
fn what_is_printed_is_what_the_schemas_say() {
    let documents = documents();
    let validators = validators(&documents);
    let mut printed = printed();
    let journal = printed.get_mut("journal").unwrap();
    journal.extend(rare_lines(journal));
    let mut faults = Vec::new();
    for (name, schema) in documents.iter().filter(|(name, _)| *name != COMMON) {
        // The lines of programs with errors are those of `interpret`.
        let of = if name == "diagnostic" { "interpret" } else { name };
        let instances = printed.get(of).unwrap_or_else(|| panic!("nothing of {name} was printed"));
        let mut tried = Tried::default();
        for instance in instances {
            if name != "diagnostic" || instance["type"] == "error" {
                tried.instance(&validators[name], instance);
            }
        }
        let unseen = named(schema).into_iter().filter(|key| {
            !tried.keys.contains(key) && !UNSEEN.contains(&(name.as_str(), key.as_str()))
        });
        faults.extend(unseen.map(|key| format!("{name}: {key} was never printed")));
        faults.extend(tried.faults().into_iter().map(|fault| format!("{name}: {fault}")));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn schemas_are_strict_and_say_what_is_what() {
    for (name, schema) in documents() {
        jsonschema::meta::validate(&schema).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema", "{name}");
        assert!(schema["title"].is_string() && schema["description"].is_string(), "{name}");
        each(&schema, &mut |schema| {
            let Some(Value::Object(properties)) = schema.get("properties") else { return };
            assert_eq!(schema["additionalProperties"], json!(false), "{name}: {schema}");
            assert!(schema["required"].is_array(), "{name}: {schema}");
            for (key, property) in properties {
                let is_told =
                    property.get("description").is_some() || property.get("$ref").is_some();
                // The constants of the thesis have no other names.
                let is_constant = ["A", "B", "C", "D"].contains(&key.as_str());
                assert!(is_told || is_constant, "{name}: {key} is not described");
            }
        });
    }
}

/// A schema that lets something pass is found out.
#[test]
fn loose_schemas_are_found_out() {
    let instances = [json!({"a": 1, "b": {"X": 2}}), json!({"a": 3, "b": {"X": 4, "Y": 5}})];
    let faults = |schema: &Value| {
        let validator = jsonschema::validator_for(schema).unwrap();
        let mut tried = Tried::default();
        instances.iter().for_each(|instance| tried.instance(&validator, instance));
        tried.faults()
    };
    let axes = json!({"type": "object", "propertyNames": {"enum": ["X", "Y"]},
                      "additionalProperties": {"type": "integer"}});
    let strict = json!({"type": "object", "properties": {"a": {"type": "integer"}, "b": axes},
                        "required": ["a", "b"], "additionalProperties": false});
    assert_eq!(faults(&strict), BTreeSet::new());
    for (pointer, value) in [
        ("/required", json!(["a"])),
        ("/additionalProperties", json!(true)),
        ("/properties/a", json!({})),
        ("/properties/b/propertyNames", json!(true)),
        ("/properties/b/additionalProperties", json!(true)),
        ("", json!(true)),
        ("", json!({})),
    ] {
        let mut loose = strict.clone();
        *loose.pointer_mut(pointer).unwrap() = value;
        assert_ne!(faults(&loose), BTreeSet::new(), "{loose}");
    }
}

#[test]
fn the_table_of_schemas_has_them_all() {
    let table = fs::read_to_string(root().join("docs/schema/README.md")).unwrap();
    for name in documents().keys() {
        let file = format!("{name}.schema.json");
        assert!(table.contains(&format!("]({file})")), "{file}");
    }
    let links = table.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    for file in links.filter(|link| link.ends_with(".json")) {
        assert!(root().join("docs/schema").join(file).exists(), "{file}");
    }
}
