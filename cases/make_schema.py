"""Makes case.schema.json, by which editors complete and check the keys of cases."""

from pathlib import Path

from femflex.case.schema import schema_text

if __name__ == "__main__":
    Path(__file__).with_name("case.schema.json").write_text(schema_text(), encoding="utf-8")
