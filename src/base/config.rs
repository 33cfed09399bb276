//! The text of a `cnc.toml` → [`Config`]: what a computer or a folder has, apart from machines.
//!
//! An unknown key is an error, with what was meant. Which files there are, and whose value wins, is
//! not known here, beyond [`Config::over`].

use std::collections::BTreeMap;

use crate::base::Diagnostic;
use crate::base::machine::keys::Keys;

/// What a file or several say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Config {
    /// `[ports.NAME]`: ports by names of the user's.
    pub ports: BTreeMap<String, PortConfig>,
}

/// How to open a port. What is not said is left to the machine profile, or to the system.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PortConfig {
    /// A path or `usb:VID:PID[:SERIAL]`.
    pub device: Option<String>,
    /// Bits a second.
    pub baud: Option<u32>,
    /// How long to wait for an answer beyond the time of wire and tick.
    pub reply_timeout_ms: Option<u32>,
    /// How long the adapter may keep received bytes back.
    pub latency_timer_ms: Option<u32>,
    /// Most bytes handed to the port at a time.
    pub write_piece_bytes: Option<u32>,
}

impl Config {
    /// Reads a file's text.
    ///
    /// # Errors
    /// All that is wrong with it, each with its place.
    pub fn parse(text: &str) -> Result<Config, Vec<Diagnostic>> {
        let mut keys = Keys::parse(text);
        let names = keys.names("ports");
        let ports = names.into_iter().map(|name| (name.clone(), port(&mut keys, &name))).collect();
        keys.check_complete();
        let faults = keys.into_faults();
        if faults.is_empty() { Ok(Config { ports }) } else { Err(faults) }
    }

    /// This, and where it says nothing what another one says, key by key.
    pub fn over(mut self, other: Config) -> Config {
        for (name, port) in other.ports {
            let nearer = self.ports.remove(&name).unwrap_or_default();
            self.ports.insert(name, nearer.over(port));
        }
        self
    }
}

impl PortConfig {
    /// This, and where it says nothing what another one says.
    pub fn over(self, other: PortConfig) -> PortConfig {
        PortConfig {
            device: self.device.or(other.device),
            baud: self.baud.or(other.baud),
            reply_timeout_ms: self.reply_timeout_ms.or(other.reply_timeout_ms),
            latency_timer_ms: self.latency_timer_ms.or(other.latency_timer_ms),
            write_piece_bytes: self.write_piece_bytes.or(other.write_piece_bytes),
        }
    }
}

fn port(keys: &mut Keys<'_>, name: &str) -> PortConfig {
    let table = format!("ports.{name}");
    if !keys.has_table(&table) {
        return PortConfig::default();
    }
    PortConfig {
        device: keys.string_if(&format!("{table}.device")),
        baud: keys.integer_if(&format!("{table}.baud"), 300..=10_000_000),
        reply_timeout_ms: keys.integer_if(&format!("{table}.reply_timeout_ms"), 1..=60_000),
        latency_timer_ms: keys.integer_if(&format!("{table}.latency_timer_ms"), 1..=255),
        write_piece_bytes: keys.integer_if(&format!("{table}.write_piece_bytes"), 1..=4096),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_are_read_and_the_nearer_file_wins() {
        let near = "[ports.mill]\nbaud = 19200\n[ports.lathe]\ndevice = \"/dev/ttyS1\"";
        let far = "[ports.mill]\ndevice = \"usb:0403:6001\"\nbaud = 38400\nreply_timeout_ms = 500\n\
                   latency_timer_ms = 1\nwrite_piece_bytes = 16";
        let both = Config::parse(near).unwrap().over(Config::parse(far).unwrap());
        assert_eq!(both.ports.keys().collect::<Vec<_>>(), ["lathe", "mill"]);
        let mill = PortConfig {
            device: Some("usb:0403:6001".to_owned()),
            baud: Some(19_200),
            reply_timeout_ms: Some(500),
            latency_timer_ms: Some(1),
            write_piece_bytes: Some(16),
        };
        assert_eq!(both.ports["mill"], mill);
        assert_eq!(Config::parse(""), Ok(Config::default()));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let check = |text: &str, line: u32, expected: &str| {
            let faults = Config::parse(text).unwrap_err();
            let said = format!("{} {}", faults[0].message, faults[0].help.as_deref().unwrap_or(""));
            assert!(said.contains(expected), "{text}: {said}");
            assert_eq!(faults[0].span.line, line, "{text}");
        };
        check("[port.mill]", 1, "did you mean 'ports'");
        check("[ports.mill]\nbuad = 9600", 2, "did you mean 'baud'");
        check("[ports.mill]\nbaud = 9", 2, "from 300");
        check("[ports.mill]\ndevice = 7", 2, "a string in quotes");
        check("ports = 1", 1, "a table is expected");
        check("[ports]\nmill = \"/dev/ttyUSB0\"", 2, "a table is expected");
        check("[ports.\"a.b\"]", 1, "holds a dot");
        check("[ports", 1, "");
    }
}
