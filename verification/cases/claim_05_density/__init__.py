"""The remark on denser liquids after Eq. 8 of the liquid-ring paper."""
