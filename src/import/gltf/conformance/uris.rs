//! URIs as the specification wants them: RFC 3986, and RFC 2397 where they hold their data (what is in it is for its readers).

use crate::import::gltf::report::quoted;

/// What is wrong with `uri` as such; whether its file is there is another question.
pub fn check(uri: &str) -> Result<(), String> {
    if let Some(data) = media_type(uri) {
        return data.map(drop);
    }
    let malformed = |why: &str| Err(format!("is {}, not a valid URI: {why}", quoted(uri)));
    if let Some((scheme, _)) = uri.split_once(':').filter(|(scheme, _)| !scheme.contains(['/', '?', '#'])) {
        let first = scheme.starts_with(|c: char| c.is_ascii_alphabetic());
        if !first || !scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c)) {
            return malformed("there is no scheme before its colon");
        }
    }
    let escapes = uri.split('%').skip(1);
    let hex = |rest: &str| rest.get(..2).is_some_and(|two| two.bytes().all(|b| b.is_ascii_hexdigit()));
    match escapes.into_iter().all(hex) {
        true => Ok(()),
        false => malformed("a % is not followed by two hexadecimal digits"),
    }
}

/// The media type of a `data:` URI; `None` where `uri` is of another scheme.
pub fn media_type(uri: &str) -> Option<Result<&str, String>> {
    let (scheme, rest) = uri.split_once(':')?;
    scheme.eq_ignore_ascii_case("data").then(|| match rest.split_once(',') {
        Some((head, _)) => Ok(head.split(';').next().unwrap_or("")),
        None => Err("is a data URI without a comma before its data".into()),
    })
}
