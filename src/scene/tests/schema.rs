//! The schema says what the parser does. Checked with a validator of its own for the part of JSON Schema that the
//! schema uses (a full one would bring fifty crates): a keyword that it does not know fails the test. Patterns are
//! not checked, nor is what the schema cannot say: files that must exist, keys that exclude each other.

use std::{fs, path::PathBuf};

use serde_json::Value;

use super::{GOOD, errors};
use crate::scene::schema;

fn committed() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes/rayo.schema.json")
}

/// Run with RAYO_UPDATE_SCHEMA=1 to write the file anew.
#[test]
fn the_committed_schema_is_current() {
    let text = format!("{:#}\n", schema());
    if std::env::var_os("RAYO_UPDATE_SCHEMA").is_some() {
        fs::write(committed(), &text).expect("the schema can be written");
    }
    let stored = fs::read_to_string(committed()).unwrap_or_default();
    assert!(stored == text, "scenes/rayo.schema.json is stale: run `RAYO_UPDATE_SCHEMA=1 cargo test schema`");
}

#[test]
fn good_scenes_are_valid() {
    for text in
        [GOOD, "", "[camera]\nimported = true\n", "[render]\nbounces = 3\nfilter = \"box\"\ntime = 90\n"]
    {
        assert_eq!(faults_of(text), Vec::<String>::new(), "{text}");
    }
}

/// The parser refuses these too: `each_error_is_told_at_its_place` and here.
#[test]
fn bad_scenes_are_invalid() {
    for text in [
        "[render]\nsampels = 1\n",
        "[rendr]\n",
        "[render]\nsize = [0, 720]\n",
        "[render]\nsize = [1, 2, 3]\n",
        "[render]\nsamples = 0\n",
        "[render]\nsamples = 1.5\n",
        "[render]\nsamples = \"many\"\n",
        "[render]\nseed = -1\n",
        "[render]\nbounces = 5000\n",
        "[render]\nbounces = { totl = 1 }\n",
        "[render]\nfilter = \"bos\"\n",
        "[render]\nfilter = { width = 0 }\n",
        "[render]\nthreads = 0\n",
        "[[render]]\n",
        "[sphere]\n",
        "[camera]\nvfov = 180\n",
        "[camera]\nvfov = 0\n",
        "[camera]\nposition = [1, 2]\n",
        "[camera]\nimported = false\n",
        "[environment]\n",
        "[environment]\ntype = \"sky\"\n",
        "[environment]\ntype = \"color\"\nbottom = 1\n",
        "[environment]\ntype = \"color\"\ncolor = [1, -1, 1]\n",
        "[materials.a]\ntype = \"diffuse\"\nfuzz = 1\n",
        "[materials.a]\ntype = \"metal\"\nfuzz = 2\n",
        "[materials.a]\ntype = \"dielectric\"\nior = 0\n",
        "[materials.a]\ncolor = 1\n",
        "[materials.a]\ntype = \"pbr\"\nnormal = { scale = 1 }\n",
        "[materials.a]\ntype = \"pbr\"\nclearcoat = 1\n",
        "[materials.a]\ntype = \"pbr\"\nsheen = { roughnes = 1 }\n",
        "[materials.a]\ntype = \"pbr\"\ntransmission = 2\n",
        "[materials.a]\ntype = \"pbr\"\nvolume = { attenuation_distance = 0 }\n",
        "[materials.a]\ntype = \"pbr\"\niridescence = { ior = 0.9 }\n",
        "[materials.a]\ntype = \"pbr\"\nanisotropy = { strength = 2 }\n",
        "[materials.a]\ntype = \"pbr\"\nabbe_number = 0\n",
        "[[sphere]]\nradius = 1\n",
        "[[model]]\nfile = \"a.glb\"\nscale = 0\n",
        "[[light]]\ntype = \"point\"\n",
        "[[light]]\ntype = \"sun\"\nangle = 200\n",
        "[output]\ndepth = 12\n",
        "[output]\nview = \"agx\"\n",
    ] {
        assert!(!faults_of(text).is_empty(), "the schema accepts\n{text}");
        assert!(!errors(text).is_empty());
    }
}

/// Editors show descriptions and complete defaults: every key has the one, and all that are not required the other
/// or an explanation.
#[test]
fn every_key_is_described() {
    let schema = schema();
    let mut keys = 0;
    visit(&schema, &mut |schema| {
        for (name, property) in schema["properties"].as_object().into_iter().flatten() {
            if name != "type" {
                assert!(property["description"].as_str().is_some_and(|text| text.len() > 5), "{name}");
                keys += 1;
            }
        }
    });
    assert!(keys > 90, "{keys}");
    assert_eq!(schema.pointer("/definitions/Render/properties/samples/default"), Some(&256.into()));
}

fn visit(schema: &Value, f: &mut impl FnMut(&Value)) {
    f(schema);
    match schema {
        Value::Object(object) => object.values().for_each(|value| visit(value, f)),
        Value::Array(items) => items.iter().for_each(|value| visit(value, f)),
        _ => {}
    }
}

fn faults_of(text: &str) -> Vec<String> {
    let schema = schema();
    let document = toml::from_str(text).expect("is TOML");
    let mut faults = Vec::new();
    validate(&document, &schema, &schema, "", &mut faults);
    faults
}

fn validate(value: &Value, schema: &Value, root: &Value, at: &str, faults: &mut Vec<String>) {
    let Some(keywords) = schema.as_object() else {
        assert!(schema.is_boolean(), "{at}");
        if schema == false {
            faults.push(format!("{at}: nothing is allowed"));
        }
        return;
    };
    let fails = |schema: &Value| {
        let mut inner = Vec::new();
        validate(value, schema, root, at, &mut inner);
        !inner.is_empty()
    };
    for (keyword, wanted) in keywords {
        let listed = || wanted.as_array().expect("is a list");
        let limit = || wanted.as_f64().expect("is a number");
        let number = value.as_f64();
        let length = value.as_array().map(|items| items.len() as f64);
        let holds = match keyword.as_str() {
            "$schema" | "title" | "description" | "default" | "definitions" | "format" | "pattern" => true,
            "$ref" => {
                let pointer = wanted.as_str().and_then(|text| text.strip_prefix('#')).expect("is local");
                !fails(root.pointer(pointer).expect("is there"))
            }
            "type" => match wanted.as_str().expect("is one") {
                "object" => value.is_object(),
                "array" => value.is_array(),
                "string" => value.is_string(),
                "number" => value.is_number(),
                "integer" => value.is_i64() || value.is_u64(),
                "boolean" => value.is_boolean(),
                other => panic!("type {other}"),
            },
            "const" => value == wanted,
            "enum" => listed().contains(value),
            "minimum" => number.is_none_or(|x| x >= limit()),
            "maximum" => number.is_none_or(|x| x <= limit()),
            "exclusiveMinimum" => number.is_none_or(|x| x > limit()),
            "exclusiveMaximum" => number.is_none_or(|x| x < limit()),
            "minItems" => length.is_none_or(|n| n >= limit()),
            "maxItems" => length.is_none_or(|n| n <= limit()),
            "items" => {
                value
                    .as_array()
                    .into_iter()
                    .flatten()
                    .for_each(|item| validate(item, wanted, root, at, faults));
                true
            }
            "required" => value.as_object().is_none_or(|object| {
                listed().iter().all(|name| object.contains_key(name.as_str().expect("is a name")))
            }),
            "properties" => {
                for (name, schema) in wanted.as_object().expect("is an object") {
                    if let Some(item) = value.get(name) {
                        validate(item, schema, root, &format!("{at}/{name}"), faults);
                    }
                }
                true
            }
            "additionalProperties" => {
                for (name, item) in value.as_object().into_iter().flatten() {
                    if schema["properties"].get(name).is_none() {
                        validate(item, wanted, root, &format!("{at}/{name}"), faults);
                    }
                }
                true
            }
            "allOf" => listed().iter().all(|schema| !fails(schema)),
            "anyOf" => listed().iter().any(|schema| !fails(schema)),
            "oneOf" => listed().iter().filter(|schema| !fails(schema)).count() == 1,
            "not" => fails(wanted),
            other => panic!("the schema uses `{other}`, which this validator does not know"),
        };
        if !holds {
            faults.push(format!("{at}: {keyword} {wanted}"));
        }
    }
}
