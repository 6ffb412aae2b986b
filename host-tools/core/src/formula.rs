//! Values of formulas as rig files write them, from their text alone: what a test holds a law's code against.
//!
//! Numbers, names, `+ - * / ^`, brackets, and the functions `abs`, `sign`, `sin`, `exp` and `dahl`, the branch of Dahl's hysteresis from
//! rest: `dahl(u) = sign(u) (1 - exp(-|u|))`. `pi` is a number.

/// Value of `text` where names stand for `values`.
///
/// # Errors
/// What cannot be read, and where.
pub fn evaluate(text: &str, values: &[(&str, f64)]) -> Result<f64, String> {
    let mut parser = Parser { text, at: 0, values };
    let value = parser.sum()?;
    match parser.rest().chars().next() {
        None => Ok(value),
        Some(other) => Err(parser.unexpected(other)),
    }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    values: &'a [(&'a str, f64)],
}

impl<'a> Parser<'a> {
    /// What is left to be read, without leading space.
    fn rest(&mut self) -> &'a str {
        let rest = self.text[self.at..].trim_start();
        self.at = self.text.len() - rest.len();
        rest
    }

    fn unexpected(&self, found: char) -> String {
        format!("`{}`, column {}: `{found}` is not expected", self.text, self.at + 1)
    }

    /// Whether the next sign is this one, which is then read.
    fn takes(&mut self, sign: char) -> bool {
        let found = self.rest().starts_with(sign);
        self.at += if found { sign.len_utf8() } else { 0 };
        found
    }

    fn sum(&mut self) -> Result<f64, String> {
        let mut value = self.product()?;
        loop {
            if self.takes('+') {
                value += self.product()?;
            } else if self.takes('-') {
                value -= self.product()?;
            } else {
                return Ok(value);
            }
        }
    }

    fn product(&mut self) -> Result<f64, String> {
        let mut value = self.signed()?;
        loop {
            if self.takes('*') {
                value *= self.signed()?;
            } else if self.takes('/') {
                value /= self.signed()?;
            } else {
                return Ok(value);
            }
        }
    }

    fn signed(&mut self) -> Result<f64, String> {
        if self.takes('-') { Ok(-self.signed()?) } else { self.power() }
    }

    fn power(&mut self) -> Result<f64, String> {
        let base = self.atom()?;
        if self.takes('^') { Ok(base.powf(self.signed()?)) } else { Ok(base) }
    }

    fn atom(&mut self) -> Result<f64, String> {
        if self.takes('(') {
            let value = self.sum()?;
            return if self.takes(')') {
                Ok(value)
            } else {
                Err(format!("`{}`: a `)` is missing", self.text))
            };
        }
        let rest = self.rest();
        let word: &str = {
            let end =
                rest.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.')).unwrap_or(rest.len());
            &rest[..end]
        };
        let Some(first) = rest.chars().next() else { return Err(format!("`{}` ends early", self.text)) };
        if word.is_empty() {
            return Err(self.unexpected(first));
        }
        self.at += word.len();
        if let Ok(number) = word.parse() {
            return Ok(number);
        }
        if self.rest().starts_with('(') {
            let of: fn(f64) -> f64 = match word {
                "abs" => f64::abs,
                "sign" => f64::signum,
                "sin" => f64::sin,
                "exp" => f64::exp,
                "dahl" => |u| (1.0 - (-u.abs()).exp()).copysign(u),
                _ => return Err(format!("`{}`: no function `{word}`", self.text)),
            };
            return Ok(of(self.atom()?));
        }
        let value = self.values.iter().find(|(name, _)| *name == word).map(|(_, value)| *value);
        value
            .or((word == "pi").then_some(std::f64::consts::PI))
            .ok_or_else(|| format!("`{}`: `{word}` has no value", self.text))
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::{Effect, MAX_STATE};
    use bowden_model::law::LAWS;

    use super::evaluate;

    #[test]
    fn products_bind_before_sums_and_powers_before_products() {
        for (text, want) in [
            ("2 + 3 * 4", 14.0),
            ("(2 + 3) * 4", 20.0),
            ("-2^2", -4.0),
            ("2 * x^2 / 4 - 1", 3.5),
            ("abs(-x) * sign(-x)", -3.0),
            ("exp(-(x - 3))", 1.0),
            ("dahl(-1)", -0.632_120_558_828_557_7),
        ] {
            let found = evaluate(text, &[("x", 3.0)]).unwrap();
            assert!((found - want).abs() < 1e-12, "{text} = {found}, expected {want}");
        }
    }

    #[test]
    fn what_cannot_be_read_is_said() {
        for (text, want) in [
            ("2 +", "`2 +` ends early"),
            ("2 $ 3", "`2 $ 3`, column 3: `$` is not expected"),
            ("(2", "`(2`: a `)` is missing"),
            ("y", "`y`: `y` has no value"),
            ("f(2)", "`f(2)`: no function `f`"),
        ] {
            assert_eq!(evaluate(text, &[]).unwrap_err(), want);
        }
    }

    /// The code of every law against the text that rig files and reports have of it, at places either side of zero.
    #[test]
    fn every_law_computes_what_its_formula_says() {
        for law in &LAWS {
            let descriptor = law.descriptor();
            let mut p = descriptor.defaults();
            for (value, factor) in p.iter_mut().zip([1.3, 1.1, 0.9]) {
                *value *= factor;
            }
            for x in [-0.7_f64, 0.2, 1.9] {
                let (variable, places) = (law.variable().name(), descriptor.parameters);
                // Time, tension and what an exponential sets in over do not go below zero.
                let x = if matches!(variable, "t_s" | "relative_tension") { x.abs() } else { x };
                let mut values: Vec<(&str, f64)> = places.iter().map(|spec| spec.name).zip(p).collect();
                values.push((variable, x));
                let mut memory = [0.0; MAX_STATE];
                law.form().remembered(&p, &mut memory, 0.0);
                let found = law.form().remembered(&p, &mut memory, x);
                let want = evaluate(law.formula(), &values).unwrap();
                let id = descriptor.id;
                assert!((found - want).abs() < 1e-12 * want.abs().max(1.0), "{id} at {x}: {found}, {want}");
            }
        }
    }
}
