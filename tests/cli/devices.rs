//! What a machine has, in words and as JSON.

use serde_json::Value;

use crate::done;

#[test]
fn devices_are_the_same_in_words_and_as_json() {
    let json: Value = serde_json::from_str(&done(&["devices", "--json"])).unwrap();
    let text = done(&["devices"]);
    assert!(text.contains(json["cpu"].as_str().unwrap()), "{text}");
    for gpu in json["gpus"].as_array().unwrap() {
        assert!(text.contains(gpu["driver"].as_str().unwrap()), "{text}");
    }
    for port in json["ports"].as_array().unwrap() {
        assert!(text.contains(port["name"].as_str().unwrap()), "{text}");
    }
    // Something answers, or what is missing is named.
    assert!(!json["gpus"].as_array().unwrap().is_empty() || !json["missing"].as_array().unwrap().is_empty(), "{json}");
    assert_eq!(text.contains("no serial port"), json["ports"].as_array().unwrap().is_empty());
}

#[cfg(feature = "gpu")]
#[test]
fn without_a_driver_the_remedy_is_named() {
    let command = std::process::Command::new(env!("CARGO_BIN_EXE_somatic"))
        .args(["devices", "--json"])
        .env("VK_DRIVER_FILES", "/nowhere.json")
        .env("VK_ICD_FILENAMES", "/nowhere.json")
        .output()
        .unwrap();
    assert!(command.status.success());
    let json: Value = serde_json::from_slice(&command.stdout).unwrap();
    let silent = json["gpus"].as_array().unwrap().is_empty();
    assert!(silent || cfg!(not(target_os = "linux")), "a driver that is nowhere answers: {json}");
    if silent {
        assert!(json["missing"][0].as_str().unwrap().contains("driver"), "{json}");
    }
}
