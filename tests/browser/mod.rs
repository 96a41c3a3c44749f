//! A headless Chromium, driven as the WebDriver standard says (<https://www.w3.org/TR/webdriver2/>).

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use base64::{Engine, prelude::BASE64_STANDARD};
use image::RgbImage;
use serde_json::{Value, json};

pub struct Browser {
    driver: Child,
    /// Of the session.
    url: String,
    /// For the browser's profile; removed with it.
    folder: tempfile::TempDir,
}

/// The driver and the browser, where both are installed.
pub fn find() -> Option<[PathBuf; 2]> {
    let on_path = |names: &[&str]| {
        let folders = env::split_paths(&env::var_os("PATH")?).collect::<Vec<_>>();
        names.iter().flat_map(|name| folders.iter().map(move |f| f.join(name))).find(|file| file.is_file())
    };
    Some([on_path(&["chromedriver"])?, on_path(&["chromium", "chromium-browser", "google-chrome"])?])
}

impl Browser {
    pub fn start([driver, browser]: &[PathBuf; 2]) -> Self {
        let folder = tempfile::tempdir().expect("folder");
        // Into a file: a driver whose pipe nobody reads to the end dies of it.
        let said = folder.path().join("driver.txt");
        let driver = Command::new(driver)
            .arg("--port=0")
            .stdout(fs::File::create(&said).expect("file"))
            .stderr(Stdio::null())
            .spawn()
            .expect("chromedriver starts");
        let mut this = Self { driver, url: String::new(), folder };
        let server = format!("http://127.0.0.1:{}", port(&said));
        let mut arguments: Vec<String> = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--disable-dev-shm-usage",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--force-device-scale-factor=1",
            "--window-size=1280,1700",
        ]
        .map(String::from)
        .into();
        arguments.push(format!("--user-data-dir={}", this.folder.path().join("profile").display()));
        let capabilities = json!({"capabilities": {"alwaysMatch": {
            "goog:chromeOptions": {"binary": browser, "args": arguments},
            "goog:loggingPrefs": {"browser": "ALL"},
        }}});
        let session = send(&format!("{server}/session"), Some(capabilities));
        this.url = format!("{server}/session/{}", session["sessionId"].as_str().expect("session"));
        this
    }

    pub fn post(&self, command: &str, body: Value) -> Value {
        send(&format!("{}/{command}", self.url), Some(body))
    }

    pub fn open(&self, file: &Path) {
        self.post("url", json!({"url": format!("file://{}", file.display())}));
    }

    /// What a function body returns.
    pub fn run(&self, script: &str) -> Value {
        self.post("execute/sync", json!({"script": script, "args": []}))
    }

    pub fn text(&self, script: &str) -> String {
        self.run(script).as_str().unwrap_or_default().to_owned()
    }

    /// Waits until an expression is true.
    pub fn wait(&self, condition: &str) {
        let end = Instant::now() + Duration::from_secs(30);
        while self.run(&format!("return Boolean({condition})")) != Value::Bool(true) {
            assert!(
                Instant::now() < end,
                "waited in vain for {condition}; the console says {:?}",
                self.console()
            );
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// What the console was told since it was last asked.
    pub fn console(&self) -> Vec<String> {
        let log = self.post("se/log", json!({"type": "browser"}));
        log.as_array().expect("entries").iter().map(ToString::to_string).collect()
    }

    /// Where the middle of an element is in the window, after it was scrolled to, and its size.
    pub fn place(&self, selector: &str) -> [f64; 4] {
        let script = format!(
            "const e = document.querySelector({selector:?}); e.scrollIntoView({{block: 'center'}}); \
             const b = e.getBoundingClientRect(); return [b.x, b.y, b.width, b.height]"
        );
        let numbers: Vec<f64> = serde_json::from_value(self.run(&script)).expect("numbers");
        numbers.try_into().expect("four")
    }

    /// Moves the mouse along points of the window; pressed from the first to the last if `drag`.
    pub fn mouse(&self, points: &[[f64; 2]], drag: bool) {
        let to =
            |[x, y]: [f64; 2]| json!({"type": "pointerMove", "x": x as i64, "y": y as i64, "duration": 20});
        let mut steps: Vec<Value> = points.iter().copied().map(to).collect();
        if drag {
            steps.insert(1, json!({"type": "pointerDown", "button": 0}));
            steps.push(json!({"type": "pointerUp", "button": 0}));
        }
        let mouse = json!({"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": steps});
        self.post("actions", json!({"actions": [mouse]}));
    }

    pub fn keys(&self, keys: &[char]) {
        let press =
            |key: &char| [json!({"type": "keyDown", "value": key}), json!({"type": "keyUp", "value": key})];
        let steps: Vec<Value> = keys.iter().flat_map(press).collect();
        self.post("actions", json!({"actions": [{"type": "key", "id": "keys", "actions": steps}]}));
    }

    /// A command of Chromium's own protocol.
    pub fn chromium(&self, command: &str, parameters: Value) {
        self.post("goog/cdp/execute", json!({"cmd": command, "params": parameters}));
    }

    /// What is in the window.
    pub fn screenshot(&self) -> RgbImage {
        let picture = send(&format!("{}/screenshot", self.url), None);
        let bytes = BASE64_STANDARD.decode(picture.as_str().expect("text")).expect("base64");
        image::load_from_memory(&bytes).expect("PNG").into_rgb8()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Even where a test has failed, nothing is left running.
        let _ = ureq::delete(&self.url).call();
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

/// The port that the driver names in its output.
fn port(said: &Path) -> u16 {
    let end = Instant::now() + Duration::from_secs(20);
    while Instant::now() < end {
        let text = fs::read_to_string(said).expect("text");
        if let Some((port, _)) =
            text.split("started successfully on port ").nth(1).and_then(|t| t.split_once('.'))
        {
            return port.parse().expect("number");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    panic!("chromedriver names no port: {}", fs::read_to_string(said).expect("text"));
}

/// The `value` of an answer.
fn send(url: &str, body: Option<Value>) -> Value {
    let answer = match body {
        Some(body) => ureq::post(url)
            .config()
            .http_status_as_error(false)
            .build()
            .header("content-type", "application/json")
            .send(body.to_string()),
        None => ureq::get(url).config().http_status_as_error(false).build().call(),
    };
    let mut answer = answer.expect("the driver answers");
    let text = answer.body_mut().with_config().limit(100 << 20).read_to_string().expect("text");
    let value: Value = serde_json::from_str(&text).expect("JSON");
    assert!(answer.status().is_success(), "{url}: {text}");
    value["value"].clone()
}
