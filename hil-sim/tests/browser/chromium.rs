//! A headless Chromium, steered over the DevTools protocol.

use std::env;
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

/// Programs that are tried, behind the one in the variable `CHROME`.
const PROGRAMS: [&str; 5] =
    ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"];
/// What the browser says on standard error before the address of its socket.
const LISTENING: &str = "DevTools listening on ";
/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(60);

/// The browser's program, if this machine has one.
pub(super) fn program() -> Option<PathBuf> {
    let named = env::var_os("CHROME").map(PathBuf::from);
    let found = |name: &PathBuf| {
        let mut command = Command::new(name);
        command.arg("--version").stdin(Stdio::null()).output().is_ok_and(|o| o.status.success())
    };
    named.into_iter().chain(PROGRAMS.map(PathBuf::from)).find(found)
}

/// A browser with one page.
pub(super) struct Browser {
    child: Child,
    socket: WebSocket<TcpStream>,
    session: Value,
    calls: u64,
    /// Events of the page since it was opened.
    events: Vec<Value>,
    _profile: tempfile::TempDir,
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Browser {
    pub(super) fn start(program: &Path) -> Self {
        let profile = tempfile::tempdir().expect("a temporary directory");
        let mut child = Command::new(program)
            .args(["--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run"])
            .args(["--hide-scrollbars", "--remote-debugging-port=0"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the browser starts");
        let mut said = BufReader::new(child.stderr.take().expect("standard error")).lines();
        let address = said
            .by_ref()
            .map_while(Result::ok)
            .find_map(|line| line.strip_prefix(LISTENING).map(str::to_owned))
            .expect("the browser names its socket");
        // Unread, its standard error would fill up.
        std::thread::spawn(move || said.for_each(drop));
        let host = address.trim_start_matches("ws://").split('/').next().unwrap_or_default();
        let stream = TcpStream::connect(host).expect("the browser listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        let (socket, _) = tungstenite::client(&address, stream).expect("the browser agrees");
        let mut browser = Self {
            child,
            socket,
            session: Value::Null,
            calls: 0,
            events: Vec::new(),
            _profile: profile,
        };
        let page = browser.call("Target.createTarget", &json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": page["targetId"], "flatten": true });
        browser.session = browser.call("Target.attachToTarget", &attach)["sessionId"].clone();
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), &json!({}));
        }
        browser
    }

    pub(super) fn call(&mut self, method: &str, parameters: &Value) -> Value {
        self.calls += 1;
        let mut request = json!({ "id": self.calls, "method": method, "params": parameters });
        if !self.session.is_null() {
            request["sessionId"] = self.session.clone();
        }
        self.socket.send(Message::text(request.to_string())).expect("the browser is there");
        loop {
            let message = self.socket.read().unwrap_or_else(|error| panic!("{method}: {error}"));
            let Ok(text) = message.to_text() else { continue };
            let Ok(mut answer) = serde_json::from_str::<Value>(text) else { continue };
            if answer["id"] == self.calls {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].take();
            }
            self.events.push(answer);
        }
    }

    /// The value of an expression in the page; promises are awaited.
    pub(super) fn value(&mut self, expression: &str) -> Value {
        let asked =
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let mut answer = self.call("Runtime.evaluate", &asked);
        let thrown = &answer["exceptionDetails"];
        assert!(thrown.is_null(), "{expression}: {thrown}");
        answer["result"]["value"].take()
    }

    pub(super) fn number(&mut self, expression: &str) -> f64 {
        let value = self.value(expression);
        value.as_f64().unwrap_or_else(|| panic!("{expression}: {value}"))
    }

    /// Opens a page in a window of this width and waits until it has been drawn.
    pub(super) fn open(&mut self, page: &Path, width: u32) {
        self.events.clear();
        self.resize(width, 1.0);
        let page = page.canonicalize().expect("a page");
        let url = format!("file://{}", page.display());
        self.call("Page.navigate", &json!({ "url": url }));
        for _ in 0..600 {
            if self.value("document.readyState + location.protocol") == "completefile:" {
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("{url} did not load");
    }

    /// Sets the width of the window, CSS pixels, and how many pixels of the screen are one of them.
    pub(super) fn resize(&mut self, width: u32, scale: f64) {
        let size =
            json!({ "width": width, "height": 900, "deviceScaleFactor": scale, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", &size);
    }

    pub(super) fn media(&mut self, medium: &str, colours: &str) {
        let feature = json!([{ "name": "prefers-color-scheme", "value": colours }]);
        self.call("Emulation.setEmulatedMedia", &json!({ "media": medium, "features": feature }));
    }

    /// Does this with the mouse at a point of the window, the left button held or not.
    fn mouse(&mut self, what: &str, (x, y): (f64, f64), count: u8) {
        let (button, held) =
            if what == "mouseMoved" && count == 0 { ("none", 0) } else { ("left", 1) };
        let event = json!({ "type": what, "x": x, "y": y, "button": button, "buttons": held, "clickCount": count });
        self.call("Input.dispatchMouseEvent", &event);
    }

    /// Moves the mouse there without a button.
    pub(super) fn hover(&mut self, at: (f64, f64)) {
        self.mouse("mouseMoved", at, 0);
    }

    pub(super) fn click(&mut self, at: (f64, f64), times: u8) {
        for count in 1..=times {
            self.mouse("mousePressed", at, count);
            self.mouse("mouseReleased", at, count);
        }
    }

    pub(super) fn drag(&mut self, from: (f64, f64), to: (f64, f64)) {
        self.mouse("mousePressed", from, 1);
        self.mouse("mouseMoved", to, 1);
        self.mouse("mouseReleased", to, 1);
    }

    /// What the page has asked for since it was opened, beside itself.
    pub(super) fn requests(&mut self) -> Vec<String> {
        self.value("1");
        let sent =
            self.events.iter().filter(|event| event["method"] == "Network.requestWillBeSent");
        let urls = sent.map(|event| event["params"]["request"]["url"].to_string());
        urls.filter(|url| !url.starts_with("\"file:")).collect()
    }

    /// Errors that the page has caused since it was opened.
    pub(super) fn errors(&mut self) -> Vec<String> {
        // What has happened until now has come when this is answered.
        self.value("1");
        let is_error = |event: &&Value| {
            let parameters = &event["params"];
            match event["method"].as_str() {
                Some("Runtime.exceptionThrown") => true,
                Some("Runtime.consoleAPICalled") => {
                    ["error", "assert"].map(Value::from).contains(&parameters["type"])
                }
                Some("Log.entryAdded") => parameters["entry"]["level"] == "error",
                _ => false,
            }
        };
        self.events.iter().filter(is_error).map(|event| event["params"].to_string()).collect()
    }
}
