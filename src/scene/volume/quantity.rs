//! What a volume's values are, as far as its file says so. A scene made for a bare volume follows from it.

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Of a CT: −1000 is air, 0 is water.
    Hounsfield,
    /// How much of a medium there is, from 0 on.
    Density,
    /// From a surface, negative within.
    Distance,
    /// None of these.
    Other,
}
