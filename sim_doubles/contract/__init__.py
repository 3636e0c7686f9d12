"""Contract of every chip's driver with its double, for chips of any package.

`row` is what a chip says about itself, `chip` the checks; `table_row` and `register_table` do the
same for a chip whose registers are a table. A test calls every check with the chip's row:

    @pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
    def test_contract(check: Check) -> None:
        check(MyChipRow)
"""
