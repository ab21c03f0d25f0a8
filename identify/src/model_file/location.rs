//! The key that stands at a place of a JSON text, such as `parameters[3].value`.

/// One level of nesting.
enum Level {
    Object(String),
    Array(usize),
}

/// The path of keys and indices that leads to a byte of a JSON text. The text need not be valid after that byte.
pub(super) fn path_at(text: &str, offset: usize) -> String {
    let bytes = text.as_bytes();
    let end = offset.min(bytes.len());
    let mut levels: Vec<Level> = Vec::new();
    let mut position = 0;
    let mut last_text = String::new();
    while position < end {
        match bytes[position] {
            b'"' => {
                let start = position + 1;
                position = start;
                while position < end && bytes[position] != b'"' {
                    position += if bytes[position] == b'\\' { 2 } else { 1 };
                }
                last_text = text.get(start..position.min(text.len())).unwrap_or_default().to_string();
            }
            b':' => {
                if let Some(Level::Object(key)) = levels.last_mut() {
                    *key = std::mem::take(&mut last_text);
                }
            }
            b'{' => levels.push(Level::Object(String::new())),
            b'[' => levels.push(Level::Array(0)),
            // An error about a closed value refers to this value.
            b'}' | b']' if position + 1 < end => {
                levels.pop();
            }
            b',' => {
                if let Some(Level::Array(index)) = levels.last_mut() {
                    *index += 1;
                }
            }
            _ => {}
        }
        position += 1;
    }
    let mut path = String::new();
    for level in &levels {
        match level {
            Level::Object(key) if key.is_empty() => {}
            Level::Object(key) if path.is_empty() => path.push_str(key),
            Level::Object(key) => path.push_str(&format!(".{key}")),
            Level::Array(index) => path.push_str(&format!("[{index}]")),
        }
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_of_a_value_has_its_keys_and_indices() {
        let text = r#"{"a": [1, {"b\"": "x, y", "c": [2, "here"]}], "d": true}"#;
        let path = |what: &str| path_at(text, text.find(what).unwrap() + 1);
        assert_eq!(path("here"), "a[1].c[1]");
        assert_eq!(path("true"), "d");
        assert_eq!(path("1,"), "a[0]");
        assert_eq!(path_at("", 5), "");
    }
}
