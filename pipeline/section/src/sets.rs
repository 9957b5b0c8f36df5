// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shares of the far field by set of sources. Sets are alike and independent, so that their scatter
//! is the error of what is read from their mean, in whatever bins it is read.

/// Shares of the emitted power: a row a set, a column a bin.
#[derive(Clone, Debug, PartialEq)]
pub struct Sets(pub Vec<Vec<f64>>);

impl Sets {
    /// Mean of all sets by bin.
    pub fn mean(&self) -> Vec<f64> {
        self.columns().map(|column| mean(&column)).collect()
    }

    /// Standard error of the mean by bin.
    pub fn errors(&self) -> Vec<f64> {
        self.columns().map(|column| variance_of_mean(&column).sqrt()).collect()
    }

    /// Sums of `each` neighbouring bins.
    #[must_use]
    pub fn summed(&self, each: usize) -> Self {
        let sums = |row: &Vec<f64>| row.chunks(each).map(|part| part.iter().sum()).collect();
        Self(self.0.iter().map(sums).collect())
    }

    /// Combines two far fields of the same sets, share by share.
    #[must_use]
    pub fn combined(&self, other: &Self, combine: impl Fn(f64, f64) -> f64) -> Self {
        let row = |(a, b): (&Vec<f64>, &Vec<f64>)| {
            a.iter().zip(b).map(|(a, b)| combine(*a, *b)).collect()
        };
        Self(self.0.iter().zip(&other.0).map(row).collect())
    }

    /// Mean over the bins of the squared mean, less what the scatter of sets adds to it.
    pub fn mean_square(&self) -> f64 {
        let square = |column: Vec<f64>| mean(&column).powi(2) - variance_of_mean(&column);
        mean(&self.columns().map(square).collect::<Vec<_>>())
    }

    /// Standard error of a figure by the jackknife: the figure without each of the sets in turn.
    pub fn error_of(&self, figure: impl Fn(&Self) -> f64) -> f64 {
        let without = |left_out: usize| {
            let mut rows = self.0.clone();
            rows.remove(left_out);
            figure(&Self(rows))
        };
        let count = self.0.len() as f64;
        let figures: Vec<f64> = (0..self.0.len()).map(without).collect();
        (count - 1.0) * variance_of_mean(&figures).sqrt()
    }

    fn columns(&self) -> impl Iterator<Item = Vec<f64>> {
        (0..self.0[0].len()).map(|bin| self.0.iter().map(|row| row[bin]).collect())
    }
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn variance_of_mean(values: &[f64]) -> f64 {
    let (count, mean) = (values.len() as f64, mean(values));
    values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count * (count - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a mean the jackknife gives the standard error itself; two sets of ±1 have the mean square
    /// 0 less a variance of 1.
    #[test]
    fn errors_are_those_of_the_scatter_of_sets() {
        let close = |got: &[f64], expected: &[f64]| {
            let near = got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
            assert!(near && got.len() == expected.len(), "{got:?}, expected {expected:?}");
        };
        let sets = Sets(vec![vec![1.0, 4.0], vec![2.0, 4.0], vec![6.0, 7.0]]);
        let errors = [(14.0_f64 / 6.0).sqrt(), 1.0];
        close(&sets.mean(), &[3.0, 5.0]);
        close(&sets.errors(), &errors);
        close(&[sets.error_of(|sets| sets.mean()[0])], &errors[..1]);
        close(&sets.summed(2).mean(), &[8.0]);
        close(&sets.combined(&sets, |a, b| a - b).errors(), &[0.0, 0.0]);
        close(&[Sets(vec![vec![1.0], vec![-1.0]]).mean_square()], &[-1.0]);
    }
}
