"""The families and the classes of their faces."""

FAMILIES = ("chair", "vase", "alien")

CLASSES: tuple[str, ...] = (
    "chair back",
    "chair seat",
    "chair legs",
    "vase base",
    "vase body",
    "vase neck",
    "vase handle",
    "alien head",
    "alien body",
    "alien limbs",
)
