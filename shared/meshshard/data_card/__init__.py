"""What a data set holds, in numbers (`card.py`), as tables (`tables.py`) and as a page with pictures (`page.py`)."""
