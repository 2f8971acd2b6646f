"""Motion made of rubber (Kwon & Lee 2008).

Read `exaggerate` (away from the average), `lengths` and `amounts` (not too far), `subjoints` (limbs that bend),
`squash`, `followthrough` with `suspended` (springs) and `orient`; then what holds it to the ground: `constrain`,
`feet`, `hips`, `soles`, `hits`, `collide` with `capsules`; and `rubber`, the whole chain.
"""
